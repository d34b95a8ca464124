"""What every oracle needs: the snapshot's form, its provenance, and care when it is written anew.

A script makes one `Snapshot`, adds cases and writes it:

    snapshot = Snapshot(__file__, oracle=["mpmath"], precision="50 digits")
    snapshot.case("values", degree=3, x=xs, y=ys)
    snapshot.write()

Numbers are written as the shortest decimals that read back as the same double; a value that needs more
is written as the pair of `high_and_low`. An oracle shares no code with the crate.

Run by itself, a script compares what it found with the snapshot that is there, says what moved and by how
much, and overwrites it only where nothing moved past its tolerance. `--accept` overwrites it all the same,
`--check` writes nothing.
"""

import argparse
import datetime
import hashlib
import importlib.metadata
import json
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SKIPPED = 77  # the exit code of a script whose oracle cannot run on this machine


def high_and_low(value):
    """A multi-precision number as two doubles whose sum it is to 106 bits."""
    high = float(value)
    return [high, float(value - high)]


def uniform(seed, count):
    """Numbers in [-1, 1) that a contract makes again from the seed: SplitMix64, the top 53 bits of each output."""
    mask = (1 << 64) - 1
    numbers = []
    for _ in range(count):
        seed = (seed + 0x9E3779B97F4A7C15) & mask
        z = seed
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        z ^= z >> 31
        numbers.append((z >> 11) * 2.0**-52 - 1.0)
    return numbers


def reflections(seed, count, anisotropic, sigma=None):
    """(σ_x, σ_y, view, light) that a contract makes again from the seed: +, −, ×, / and √ only, which round alike everywhere.

    σ from 0.005 to 1, or as given; a third of the views graze, down to a cosine of 1e-6; slopes of the half vector to 4σ; lights above the horizon.
    """
    rows = []
    numbers = iter(uniform(seed, 32 * count))
    while len(rows) < count:
        a, b, c, graze, x, y, p, q = (next(numbers) for _ in range(8))
        a, b, c = 0.5 * (a + 1.0), 0.5 * (b + 1.0), 0.5 * (c + 1.0)
        sigma_x = sigma or 0.005 + 0.995 * (a * a * a)
        sigma_y = 0.005 + 0.995 * (b * b * b) if anisotropic else sigma_x
        cosine = 1e-6 + 0.1 * (c * c * c * c) if graze < -1.0 / 3.0 else 0.1 + 0.9 * c
        radius = math.sqrt((1.0 - cosine) * (1.0 + cosine)) / math.sqrt(x * x + y * y)
        view = (x * radius, y * radius, cosine)
        half_x, half_y = 2.8 * sigma_x * p, 2.8 * sigma_y * q
        twice = 2.0 * (half_x * view[0] + half_y * view[1] + cosine) / (half_x * half_x + half_y * half_y + 1.0)
        light = (twice * half_x - view[0], twice * half_y - view[1], twice - cosine)
        length = math.sqrt(light[0] * light[0] + light[1] * light[1] + light[2] * light[2])
        light = (light[0] / length, light[1] / length, light[2] / length)
        if light[2] > 0.0:
            rows.append((sigma_x, sigma_y, view, light))
    return rows


def skip(why):
    """Ends the script where its oracle cannot run on this machine; the old snapshot stays."""
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


class Snapshot:
    """The answers of one oracle.

    oracle: the distributions that answered, whose versions are looked up, or a dictionary {name: version}.
    precision: in words.
    tolerance: how far a value may move, relative to the largest magnitude in its field, before it is a change
    that somebody has to accept. 0 means not a bit.
    """

    def __init__(self, script, oracle, precision, tolerance=0.0):
        script = pathlib.Path(script).resolve()
        self.subject = script.stem
        self.tolerance = tolerance
        if not isinstance(oracle, dict):
            oracle = {name: importlib.metadata.version(name) for name in oracle}
        self.provenance = {
            "subject": self.subject,
            "oracle": oracle,
            "script": script.relative_to(ROOT).as_posix(),
            "script_sha256": hashlib.sha256(script.read_bytes()).hexdigest(),
            "command": f"scripts/regenerate-oracles {self.subject}",
            "date": datetime.date.today().isoformat(),
            "precision": precision,
        }
        self.cases = []

    def case(self, name, tolerance=None, **fields):
        """Adds a case: its name, and any inputs and answers. Cases of one name have the same fields."""
        case = {"name": name}
        if tolerance is not None:
            case["tolerance"] = tolerance
        for key, value in fields.items():
            case[key] = plain(value, f"{name}.{key}")
        self.cases.append(case)

    def write(self):
        """Compares with the snapshot that is there, and overwrites it where that is right."""
        options = argparse.ArgumentParser(description=f"the oracle of {self.subject}")
        options.add_argument("--accept", action="store_true", help="overwrite values that moved past their tolerance")
        options.add_argument("--check", action="store_true", help="compare only, write nothing")
        options = options.parse_args()
        path = ROOT / "oracles" / "snapshots" / f"{self.subject}.json"
        if not path.exists():
            print(f"{self.subject}: new, {len(self.cases)} cases")
            if options.check:
                sys.exit(1)
            self._write_to(path)
            return
        old = json.loads(path.read_text())
        moved, gone, news = compare(old["cases"], self.cases, self.tolerance)
        for line in gone + news:
            print(f"{self.subject}: {line}")
        refused = bool(gone)
        for where, shift, allowed in sorted(moved, key=lambda entry: -entry[1])[:20]:
            past = shift > allowed
            refused |= past
            print(f"{self.subject}: {where} moved by {shift:.2e}, {'past' if past else 'within'} its tolerance {allowed:.0e}")
        if refused and not options.accept:
            print(f"{self.subject}: kept as it was; --accept overwrites it")
            sys.exit(1)
        same_origin = all(old["provenance"].get(key) == self.provenance[key] for key in self.provenance if key != "date")
        if same_origin and not (refused or news):
            print(f"{self.subject}: reproduced, {len(self.cases)} cases")
        elif options.check:
            print(f"{self.subject}: would be written anew")
        else:
            self._write_to(path)
            print(f"{self.subject}: written, {len(self.cases)} cases")

    def _write_to(self, path):
        path.parent.mkdir(exist_ok=True)
        lines = ["{", ' "provenance": ' + json.dumps(self.provenance, ensure_ascii=False, indent=1).replace("\n", "\n ") + ",", ' "cases": [']
        for i, case in enumerate(self.cases):
            fields = [f"   {json.dumps(key)}: {json.dumps(value, ensure_ascii=False, allow_nan=False)}" for key, value in case.items()]
            lines.append("  {\n" + ",\n".join(fields) + "\n  }" + ("," if i + 1 < len(self.cases) else ""))
        lines += [" ]", "}", ""]
        aside = path.with_suffix(".json.new")
        aside.write_text("\n".join(lines))
        aside.replace(path)


def plain(value, where):
    """The value as JSON has it; every number finite."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if value is None or isinstance(value, (bool, str, int)):
        return value
    if isinstance(value, (list, tuple)):
        return [plain(entry, where) for entry in value]
    if isinstance(value, dict):
        return {key: plain(entry, where) for key, entry in value.items()}
    value = float(value)
    if not math.isfinite(value):
        raise ValueError(f"{where} holds {value}")
    return value


def compare(old, new, tolerance):
    """What moved [(where, shift, allowed)], what is gone, what is new; cases are matched by name and order."""

    def keyed(cases):
        count = {}
        for case in cases:
            i = count[case["name"]] = count.get(case["name"], -1) + 1
            yield f"{case['name']}[{i}]", case

    old, new = dict(keyed(old)), dict(keyed(new))
    gone = [f"{key} is gone" for key in old if key not in new]
    news = [f"{key} is new" for key in new if key not in old]
    moved = []
    for key in old:
        for field in old[key] if key in new else ():
            if field == "tolerance":
                continue
            where = f"{key}.{field}"
            if field not in new[key]:
                gone.append(f"{where} is gone")
                continue
            a, b = list(leaves(old[key][field])), list(leaves(new[key][field]))
            allowed = new[key].get("tolerance", tolerance)
            if len(a) != len(b):
                gone.append(f"{where} had {len(a)} values and has {len(b)}")
            elif a != b:
                numbers = all(isinstance(x, (int, float)) for x in a + b)
                scale = max((abs(x) for x in a), default=0.0) if numbers else 0.0
                shift = max(abs(x - y) for x, y in zip(a, b)) / scale if scale else math.inf
                moved.append((where, shift, allowed))
    return moved, gone, news


def leaves(value):
    """The numbers and words of a nested value, in order."""
    if isinstance(value, list):
        for entry in value:
            yield from leaves(entry)
    elif isinstance(value, dict):
        for key in value:
            yield from leaves(value[key])
    else:
        yield value
