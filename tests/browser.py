"""Chromium without a window: what a page becomes there, and what it says on its console."""

import shutil
import subprocess
from pathlib import Path

import pytest

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = ("--headless=new", "--no-sandbox", "--enable-logging=stderr", "--v=0", "--window-size=640,480", "--dump-dom")
"""The window is small, for every pixel of a picture in three dimensions is drawn by the processor."""
FLAT, DEEP = ("--disable-gpu",), ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""A page of text, and one with a picture in three dimensions."""
PATIENT = 400  # [s]

needs_a_browser = pytest.mark.skipif(BROWSER is None, reason="needs chromium")


def loaded(url: str, profile: Path, *flags: str) -> tuple[str, list[str]]:
    """The elements of a page once its scripts have run, and the lines that it wrote to its console."""
    command = [str(BROWSER), *FLAGS, *flags, f"--user-data-dir={profile}", url]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=PATIENT)
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def drawn(page: Path, profile: Path, *flags: str) -> tuple[set[str], str]:
    """The layers that a page of the viewer has drawn without an error, and its elements."""
    elements, told = loaded(page.as_uri(), profile, *DEEP, *flags, "--virtual-time-budget=5000")
    assert not [line for line in told if "Uncaught" in line or "ERROR:CONSOLE" in line or "Failed" in line]
    return set(elements.rpartition('data-drawn="')[2].partition('"')[0].split(",")), elements
