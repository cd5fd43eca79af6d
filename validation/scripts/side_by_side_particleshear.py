#!/usr/bin/env python3
"""Times one small oscillation in the original program (particleShear, PyPI) and in Viscose's compat mode.

    python3 validation/scripts/side_by_side_particleshear.py [--grains 20] [--relative-frequency 0.1] [--viscose target/release/viscose]

Installs the original into a virtual environment of its own (folder --venv), runs it without windows, then runs the same
parameters with `viscose validate granular/oscillation`. The samples are random and differ; the cost does not.
The default 20 grains take minutes in the original; 150 grains at relative frequency 0.025 take most of an hour.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import venv

RUN = """
import json, resource, sys
import particleShear
values = particleShear.doParticleShearSimulation(
    root_folder=sys.argv[1], N=int(sys.argv[2]), relative_frequency=float(sys.argv[3]), theAmplitude=0.2, theMu=0.01,
    packing_fraction=1.5, do_permanent_links=True, cut_lines=0, doDrawing=False, plotStress=False, saveData=False,
    saveStressTensorData=False)
usage = resource.getrusage(resource.RUSAGE_SELF)
print("RESULT " + json.dumps({"seconds": usage.ru_utime, "value": repr(values)}))
"""


def original(arguments, environment):
    """Runs the original and returns its processor seconds and what it returned."""
    python = environment / "bin" / "python"
    if not python.exists():
        venv.create(environment, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "particleShear==1.0.2"], check=True)
    with tempfile.TemporaryDirectory() as folder:
        command = [python, "-c", RUN, folder, str(arguments.grains), str(arguments.relative_frequency)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    line = next(line for line in done.stdout.splitlines() if line.startswith("RESULT "))
    return json.loads(line.removeprefix("RESULT "))


def ours(arguments):
    """Runs the compat mode and returns its processor seconds and G', G''."""
    sets = {
        "grains": arguments.grains,
        "relative_frequency": arguments.relative_frequency,
        "mode": "compat",
        "cut_lines": 0,
        "seeds": 1,
    }
    command = [arguments.viscose, "validate", "granular/oscillation", "--json"]
    for name, value in sets.items():
        command += ["--set", f"{name}={value}"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    measured = json.loads(done.stdout.splitlines()[0])["measured"]
    return {"seconds": seconds, "value": (measured["g_prime"], measured["g_double_prime"])}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grains", type=int, default=20)
    parser.add_argument("--relative-frequency", type=float, default=0.1)
    parser.add_argument("--viscose", default="target/release/viscose")
    parser.add_argument("--venv", type=pathlib.Path, default=pathlib.Path(tempfile.gettempdir()) / "particleshear-venv")
    arguments = parser.parse_args()
    here = ours(arguments)
    print(f"viscose   {here['seconds']:10.2f} s of processor time   G', G'' (overall) = {here['value']}")
    there = original(arguments, arguments.venv)
    print(f"original  {there['seconds']:10.2f} s of processor time   returned {there['value']}")
    print(f"ratio     {there['seconds'] / max(here['seconds'], 1e-9):10.0f}")


if __name__ == "__main__":
    sys.exit(main())
