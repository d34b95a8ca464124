"""The programs of Radiance that the wheel of pyradiance carries."""

import os
import pathlib
import subprocess

import pyradiance

PACKAGE = pathlib.Path(pyradiance.__file__).parent


def run(program, *arguments, **options):
    """What a program of Radiance prints, as bytes."""
    environment = {**os.environ, "RAYPATH": str(PACKAGE / "lib")}
    command = [str(PACKAGE / "bin" / program), *map(str, arguments)]
    return subprocess.run(command, env=environment, check=True, capture_output=True, **options).stdout


def release():
    """Radiance's own release, such as 6.0a."""
    return run("rtrace", "-version").decode().split()[1]
