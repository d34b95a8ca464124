"""Radiance's pictures, as Radiance's own pvalue and ra_xyze read them."""

import importlib.metadata
import pathlib
import tempfile

import numpy as np
import radiance_tools
from snapshot import Snapshot, uniform

snapshot = Snapshot(
    __file__,
    oracle={"Radiance": radiance_tools.release(), "pyradiance": importlib.metadata.version("pyradiance")},
    precision="single",
)


def picture(resolution, pixels, header=b"", layout=b"rgbe"):
    return b"#?RADIANCE\n" + header + b"FORMAT=32-bit_rle_" + layout + b"\n\n" + resolution + b"\n" + bytes(pixels)


def new_runs(width, rows):
    """Run-length encoding by components, as since 1991: each scanline by a run where it can, else by a dump."""
    out = b""
    for row in rows:
        out += bytes([2, 2, width >> 8, width & 255])
        for component in range(4):
            values, i = row[component::4], 0
            while i < width:
                run = 1
                while i + run < width and run < 127 and values[i + run] == values[i]:
                    run += 1
                if run > 2:
                    out, i = out + bytes([128 + run, values[i]]), i + run
                else:
                    out, i = out + bytes([1, values[i]]), i + 1
    return out


def decode(data):
    """The linear values as Radiance reads them, exposure undone, top row first, each from the left."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "picture.hdr"
        path.write_bytes(data)
        places = np.array([line.split()[:2] for line in radiance_tools.run("pvalue", "-h", "-H", "-o", path).splitlines()], dtype=int)
        values = np.frombuffer(radiance_tools.run("pvalue", "-h", "-H", "-o", "-d", "-df", path), dtype=np.float32)
    x, y = places.T
    ordered = np.zeros((y.max() + 1, x.max() + 1, 3))
    ordered[y.max() - y, x] = values.reshape(-1, 3)
    return ordered


# Mantissas and exponents of every kind, an exponent of 0 among them (black, whatever the mantissa).
noise = [int(128 * (u + 1)) for u in uniform(8, 4 * 40)]
pixels = [value if i % 4 < 3 else 120 + value % 16 for i, value in enumerate(noise)]
pixels[3], pixels[7], pixels[11] = 0, 1, 255
plain = {}
for resolution in ("-Y 5 +X 8", "-Y 5 -X 8", "+Y 5 +X 8", "+Y 5 -X 8", "+X 8 -Y 5", "-X 8 -Y 5", "+X 8 +Y 5", "-X 8 +Y 5"):
    plain[resolution] = picture(resolution.encode(), pixels)
plain["exposure"] = picture(b"-Y 5 +X 8", pixels, b"EXPOSURE=2.5\nEXPOSURE= 4\nCOLORCORR=1 2 0.5\n")
rows = [[128, 64, 7, 130] * 9 + pixels[4 * i : 4 * i + 12] for i in range(3)]
plain["new runs"] = picture(b"-Y 3 +X 12", new_runs(12, rows))
# Old runs: (1, 1, 1, n) repeats the pixel before it n times; a second one in a row counts in 256s.
plain["old runs"] = picture(b"-Y 1 +X 270", [128, 64, 7, 130, 1, 1, 1, 10, 1, 1, 1, 1, 9, 8, 7, 128, 9, 9, 7, 128, 3, 2, 1, 128])
for name, data in plain.items():
    snapshot.case("picture", what=name, file=data.hex(), pixels=decode(data))

# XYZE holds photometric units; ra_xyze turns it to RGBE, whose mantissas cost half a step of 1/128 of the largest channel.
xyze = picture(b"-Y 1 +X 3", [128, 128, 128, 129, 200, 190, 30, 128, 100, 128, 60, 135], layout=b"xyze")
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "xyze.hdr"
    path.write_bytes(xyze)
    snapshot.case("picture-xyze", file=xyze.hex(), pixels=decode(radiance_tools.run("ra_xyze", "-r", path)))
snapshot.write()
