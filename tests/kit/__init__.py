"""What most tests share, to be imported from one place."""

from tests.kit.cameras import write_cameras  # noqa: F401
from tests.kit.commands import names, refused, run, save_opaque, stages, stages_of  # noqa: F401
from tests.kit.configs import BLIND, blind, changed, without_look  # noqa: F401
from tests.kit.for_each import for_each  # noqa: F401
from tests.scenes import real_scene, save_upright, still_life_of  # noqa: F401
