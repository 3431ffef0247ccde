"""The study of kinesthetic teaching: does a task that failed succeed after one correction by hand?"""

from tactful.studies.teaching._settings import calibrated
from tactful.studies.teaching._study import teaching_study
from tactful.studies.teaching._trials import draw_trials, trial

__all__ = ["calibrated", "draw_trials", "teaching_study", "trial"]
