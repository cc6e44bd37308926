"""What MuJoCo warns of, kept instead of printed."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

from models.errors import one_line


@contextmanager
def warnings_kept() -> Iterator[list[str]]:
    """The list that MuJoCo's warnings within are in afterwards, each in one line and once.

    Without a listener, MuJoCo prints them, and writes them into a file where the user is.
    """
    said: list[str] = []
    heard: list[str] = []
    former = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(heard.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            yield said
    finally:
        mujoco.set_mju_user_warning(former)
        said += dict.fromkeys(one_line(each) for each in (*heard, *(each.message for each in caught)))
