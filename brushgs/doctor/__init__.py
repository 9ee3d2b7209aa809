"""Faults and oddities of a scene file, and their cure.

    raw columns -> detect encoding -> decode -> check rows, places, light, floaters -> findings -> cure

Each check returns findings (see `findings`); thresholds state the figures of real scenes that they come from.
`cure` applies the findings.
"""

from brushgs.doctor.examination import Examination, examine, examine_file
from brushgs.doctor.findings import Finding
from brushgs.doctor.run import DoctorReport, cure, run_doctor

__all__ = ["DoctorReport", "Examination", "Finding", "cure", "examine", "examine_file", "run_doctor"]
