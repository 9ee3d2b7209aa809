"""What is wrong or odd with a scene file, and the cure.

    read (raw) -> which reading? -> decode -> rows, places, light -> floaters -> guesses -> findings -> cure

`encodings` finds out how the numbers are to be read; everything after it looks at the scene read so. Each
check returns findings (see `findings`), with constants beside it that say from which figures of real scenes
they come. `cure` applies them.
"""

from brushgs.doctor.cure import cure
from brushgs.doctor.examination import Examination, examine, look_at
from brushgs.doctor.findings import Finding
from brushgs.doctor.run import DoctorReport, run_doctor

__all__ = ["DoctorReport", "Examination", "Finding", "cure", "examine", "look_at", "run_doctor"]
