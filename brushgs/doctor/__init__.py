"""What is wrong or odd with a scene file, and the cure.

    raw columns -> detect encoding -> decode -> check rows, places, light, floaters -> findings -> cure

Each check returns findings (see `findings`); the thresholds beside it state the figures of real scenes they
come from. `cure` applies the findings.
"""

from brushgs.doctor.cure import cure
from brushgs.doctor.examination import Examination, examine, examine_file
from brushgs.doctor.findings import Finding
from brushgs.doctor.run import DoctorReport, run_doctor

__all__ = ["DoctorReport", "Examination", "Finding", "cure", "examine", "examine_file", "run_doctor"]
