"""Ctrl-C ends long calls within a second."""

import signal
import subprocess
import sys
import threading
import time

import lobes
import numpy as np
import pytest

CALLS = {
    "render": "lobes.Renderer(light).render(material, size=1024, tolerance=1e-5)",
    "one thread": "lobes.Renderer(light).render(material, size=1024, tolerance=1e-5, threads=False)",
    "training": "lobes.Training(lobes.builtin(), cameras=64)",
    "analyse": "maps = np.zeros((60, 512, 1024)); t = lobes.Transform('gauss-legendre', 512, 1024, 511); [t.analyse(maps) for _ in range(10_000)]",
    "basis": "lobes.gradients_at(np.ones(1024**2), np.random.default_rng(1).random((100_000, 3)))",
    "rotate": "sets = np.zeros((50, 512**2)); r = lobes.Rotation(511); [r.rotate(sets, [1, 2, 3, 4]) for _ in range(10_000)]",
    "spectra": "[light.spectrum() for _ in range(10_000)]",
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_control_c(call):
    program = f"""
import lobes, numpy as np, time
light = lobes.builtin()[0]
material = lobes.Material.plastic("p", [0.5] * 3, 0.05, 0.2)
print("ready", flush=True)
try:
    {call}
    print("done")
except KeyboardInterrupt:
    print("stopped")
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            time.sleep(2)
            start = time.monotonic()
            process.send_signal(signal.SIGINT)
            assert process.stdout.readline() == "stopped\n"
            # A second, and as much again for a busy machine.
            assert time.monotonic() - start < 2
        finally:
            process.kill()


def test_what_progress_raises_ends_the_work():
    def give_up(done, total):
        raise InterruptedError(f"{done} of {total}")

    before = time.monotonic()
    with pytest.raises(InterruptedError, match="of 34"):
        lobes.Training(lobes.builtin(), cameras=1, progress=give_up)
    assert time.monotonic() - before < 60


def test_other_threads_run_meanwhile():
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    lobes.Renderer(lobes.builtin()[0]).render(lobes.presets()[0], size=64)
    lobes.Transform("gauss-legendre", 256, 512, 255).analyse(np.zeros((20, 256, 512)))
    end = time.monotonic()
    stop.set()
    thread.join()
    assert len(ticks) > 5 * (end - start)


def test_sentences_are_pythons():
    flat = lobes.Picture(np.full((64, 64, 3), 0.5))
    for wrong in [flat.circle, lambda: lobes.Picture(np.zeros((9, 9, 3)), mask=np.zeros((9, 9))).circle()]:
        with pytest.raises(ValueError) as raised:
            wrong()
        assert "--" not in str(raised.value) and "::" not in str(raised.value)
