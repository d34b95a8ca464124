"""scripts/fetch-debevec against a server on loopback that serves stand-ins: python3.11 -m unittest discover scripts/tests"""

import hashlib
import http.server
import os
import pathlib
import pty
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCRIPT = ROOT / "scripts" / "fetch-debevec"
NAMES = ["beach_probe.hdr", "stpeters_probe.hdr", "stpeters_cross.hdr", "uffizi_probe.hdr"]
TAKEN = [name for name in NAMES if name != "stpeters_cross.hdr"]
UNKNOWN = {"stpeters_probe.hdr", "uffizi_probe.hdr"}
SIZE = 150_000
HALF = SIZE // 2


def stand_in(seed):
    return b"#?RADIANCE\n" + random.Random(seed).randbytes(SIZE - 11)


FILES = {name: stand_in(name) for name in NAMES}


def sum_of(data):
    return hashlib.sha256(data).hexdigest()


class Handler(http.server.BaseHTTPRequestHandler):
    """Serves `server.files`; `server.plans[name]` holds what happens to the next requests for that name."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        name = self.path.rsplit("/", 1)[1]
        asked = self.headers.get("Range")
        self.server.requests.append((name, asked))
        plans = self.server.plans.get(name, [])
        plan = plans.pop(0) if plans else ""
        data = self.server.files.get(name)
        if data is None:
            return self.status(404)
        if plan.startswith("status "):
            return self.status(int(plan.split()[1]), plan.split()[2:])
        if plan == "silent":
            self.server.released.wait(30)
            return
        self.close_connection = True
        tag = f'"{sum_of(data)[:16]}"' if self.server.tagged else None
        if plan == "splice":  # keeps the name of the version whatever the file holds
            tag = self.headers["If-Range"]
        start = 0
        matches = self.headers.get("If-Range") in (None, tag) or plan == "ignores If-Range"
        if asked and matches and plan != "ignores Range":
            start = int(re.fullmatch(r"bytes=(\d+)-", asked)[1])
            if start >= len(data):
                return self.status(416)
            self.send_response(206)
            said = start - 7 if plan == "other part" else start
            self.send_header("Content-Range", f"bytes {said}-{len(data) - 1}/{len(data)}")
        else:
            self.send_response(200)
        if tag:
            self.send_header("ETag", tag)
        body = data[start:]
        if plan.startswith("chunked"):
            self.send_header("Transfer-Encoding", "chunked")
            self.end_headers()
            sent = body if plan == "chunked" else body[:HALF]
            self.wfile.write(b"%x\r\n%s\r\n" % (len(sent), sent) + (b"0\r\n\r\n" if plan == "chunked" else b""))
            return
        if plan == "too long":
            self.send_header("Content-Length", 1 << 40)
        elif plan != "no length":
            self.send_header("Content-Length", len(body))
        self.end_headers()
        if plan == "drip":
            for byte in body[:200]:
                self.wfile.write(bytes([byte]))
                self.server.released.wait(0.02)
        elif plan.startswith("stop at "):
            self.wfile.write(body[: int(plan.split()[2])])
            self.server.released.wait(30)
        elif plan.startswith("cut at "):
            self.wfile.write(body[: int(plan.split()[2])])
        else:
            self.wfile.write(body)

    def status(self, code, wait=()):
        self.send_response(code)
        if wait:
            self.send_header("Retry-After", wait[0])
        self.send_header("Content-Length", "0")
        self.end_headers()


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.files, self.plans, self.requests = dict(FILES), {}, []
        self.tagged = True
        self.released = threading.Event()
        self.address = f"http://127.0.0.1:{self.server_port}/Probes/"
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()

    def handle_error(self, *_):
        pass  # a client that went away


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.at = pathlib.Path(folder.name)
        self.probes = self.at / "probes"
        self.list = self.at / "list.txt"
        self.write_list(UNKNOWN)
        self.server = Server()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.server.released.set)

    def write_list(self, unknown):
        lines = [f"{'-' if name in unknown else sum_of(data)}  {name}" for name, data in FILES.items()]
        self.list.write_text("# stand-ins\n\n" + "\n".join(lines) + "\n")

    def start(self, *options, source=None, folder=None, largest_file=resource.RLIM_INFINITY, **more):
        command = [sys.executable, SCRIPT, folder or self.probes, "--list", self.list, "--pause", "0.01"]
        command += ["--from", source or self.server.address, *options]
        environment = {name: value for name, value in os.environ.items() if not name.lower().endswith("_proxy")}
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **more}

        def prepare():
            # Where a shell started us in the background, SIGINT would be ignored by its children too.
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))

        process = subprocess.Popen(command, text=True, env=environment, preexec_fn=prepare, **streams)
        self.addCleanup(process.__exit__, None, None, None)
        self.addCleanup(process.kill)
        return process

    def run_script(self, *options, code, **more):
        process = self.start(*options, **more)
        out, err = process.communicate(timeout=60)
        self.assertNotIn("Traceback", err)
        self.assertEqual(process.returncode, code, out + err)
        return out, err

    def names(self):
        return sorted(path.name for path in self.probes.iterdir())

    def assert_whole(self, names=TAKEN):
        self.assertEqual(self.names(), sorted(names))
        for name in names:
            self.assertEqual((self.probes / name).read_bytes(), self.server.files[name], name)

    def await_part(self, process, name, size):
        part = self.probes / f"{name}.part"
        for _ in range(1000):
            if part.exists() and part.stat().st_size >= size:
                return part
            self.assertIsNone(process.poll())
            time.sleep(0.01)
        self.fail(f"{part} did not come to {size} bytes")


class Right(Case):
    def test_all_come_and_the_command_is_the_last_line(self):
        out, err = self.run_script(code=0)
        self.assertEqual(err, "")
        self.assert_whole()
        self.assertEqual(
            out.splitlines()[-1], f"cargo run --release -- reproduce --illuminations {self.probes} --mapping angular-map"
        )
        self.assertIn("copyright Paul Debevec", out)
        self.assertIn("may not be copied into its repository", out)
        self.assertIn("http://www.debevec.org/Probes/", out)

    def test_what_has_no_sum_on_record_is_named_with_its_sum(self):
        out, _ = self.run_script(code=0)
        for name in TAKEN:
            line = next(line for line in out.splitlines() if line.startswith(name))
            self.assertEqual(sum_of(FILES[name]) in line, name in UNKNOWN, line)
            self.assertEqual("on record, so compare" in line, name in UNKNOWN, line)

    def test_a_second_run_fetches_nothing(self):
        self.run_script(code=0)
        self.server.requests.clear()
        out, err = self.run_script(code=0)
        self.assertEqual(self.server.requests, [])
        self.assertEqual((out.count("there already"), err), (len(TAKEN), ""))
        self.assertIn("cargo run", out)
        self.assert_whole()

    def test_the_cross_of_saint_peters_takes_the_place_of_the_angular_map(self):
        self.run_script("--stpeters", "cross", code=0)
        self.assert_whole(["beach_probe.hdr", "stpeters_cross.hdr", "uffizi_probe.hdr"])
        # With both there, one place would count twice.
        for name in ["readme.txt", ".hidden.hdr", "Studio.EXR"]:
            (self.probes / name).touch()
        out, _ = self.run_script(code=0)
        self.assertEqual(re.findall(r"^(\S+) is in", out, re.MULTILINE), ["Studio.EXR", "stpeters_cross.hdr"])

    def test_an_address_without_its_last_slash(self):
        self.run_script(source=self.server.address.removesuffix("/"), code=0)
        self.assert_whole()

    def test_a_name_with_a_space_is_quoted(self):
        folder = self.at / "light probes"
        out, _ = self.run_script(folder=folder, code=0)
        self.assertIn(f"--illuminations '{folder}'", out)

    def test_chunks(self):
        self.server.plans = {name: ["chunked"] for name in TAKEN}
        self.run_script(code=0)
        self.assert_whole()

    def test_progress_is_shown_on_a_terminal_only(self):
        ours, theirs = pty.openpty()
        self.addCleanup(os.close, ours)
        process = self.start(stderr=theirs)
        os.close(theirs)
        out, _ = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0)
        self.assertIn(b"beach_probe.hdr: ", os.read(ours, 10_000))
        self.assertNotIn("\r", out)

    def test_the_list_of_the_repository(self):
        lines = [line.split() for line in SCRIPT.with_suffix(".txt").read_text().splitlines() if not line.startswith("#")]
        places = "beach building campus galileo grace kitchen rnl stpeters uffizi".split()
        self.assertEqual(
            [name for _, name in lines if name != "stpeters_cross.hdr"], [f"{place}_probe.hdr" for place in places]
        )
        self.assertEqual({name for found, name in lines if found == "-"}, UNKNOWN)


class Resumed(Case):
    def test_a_download_that_is_cut_goes_on_from_there(self):
        for name in ["beach_probe.hdr", "uffizi_probe.hdr"]:
            self.server.plans[name] = [f"cut at {HALF}", f"cut at {1000}"]
        _, err = self.run_script(code=0)
        self.assert_whole()
        self.assertIn(f"ended after {HALF} of {SIZE} bytes", err)
        ranges = [asked for name, asked in self.server.requests if name == "beach_probe.hdr"]
        self.assertEqual(ranges, [None, f"bytes={HALF}-", f"bytes={HALF + 1000}-"])

    def test_so_it_does_in_the_next_run(self):
        self.server.plans["beach_probe.hdr"] = [f"cut at {HALF}"]
        out, err = self.run_script("--retries", "0", code=1)
        self.assertIn("what came of it is kept", err)
        self.assertNotIn("cargo run", out)
        self.assertNotIn("beach_probe.hdr", self.names())
        self.assertEqual((self.probes / "beach_probe.hdr.part").read_bytes(), FILES["beach_probe.hdr"][:HALF])
        self.server.requests.clear()
        self.run_script(code=0)
        self.assertEqual(self.server.requests, [("beach_probe.hdr", f"bytes={HALF}-")])
        self.assert_whole()

    def test_a_server_that_ignores_range_gives_it_all_again(self):
        for name in TAKEN:
            self.server.plans[name] = [f"cut at {HALF}", "ignores Range"]
        self.run_script(code=0)
        self.assert_whole()

    def test_a_server_that_answers_with_another_part_is_asked_anew(self):
        for name in TAKEN:
            self.server.plans[name] = [f"cut at {HALF}", "other part"]
        _, err = self.run_script(code=0)
        self.assertIn("another part than was asked", err)
        self.assert_whole()

    def test_a_file_that_changed_meanwhile_is_fetched_anew(self):
        for plan, requests in [("", 1), ("ignores If-Range", 2)]:
            with self.subTest(plan):
                shutil.rmtree(self.probes, ignore_errors=True)
                self.server.files["uffizi_probe.hdr"] = FILES["uffizi_probe.hdr"]
                self.server.plans["uffizi_probe.hdr"] = [f"cut at {HALF}"]
                self.run_script("--retries", "0", code=1)
                self.server.files["uffizi_probe.hdr"] = stand_in("another version")
                self.server.plans["uffizi_probe.hdr"] = [plan]
                self.server.requests.clear()
                self.run_script(code=0)
                self.assertEqual(len(self.server.requests), requests)
                self.assert_whole()

    def test_pieces_of_two_versions_under_one_tag_are_noticed_by_the_sum(self):
        self.server.files["beach_probe.hdr"] = stand_in("another version")
        self.server.plans["beach_probe.hdr"] = [f"cut at {HALF}"]
        self.run_script("--retries", "0", code=1)
        self.server.files["beach_probe.hdr"] = FILES["beach_probe.hdr"]
        self.server.plans["beach_probe.hdr"] = ["splice"]
        self.run_script(code=0)
        self.assert_whole()

    def test_where_a_server_names_no_versions_it_starts_anew(self):
        self.server.tagged = False
        self.server.plans = {name: [f"cut at {HALF}"] for name in TAKEN}
        self.run_script(code=0)
        self.assertEqual({asked for _, asked in self.server.requests}, {None})
        self.assert_whole()

    def test_from_another_address_it_starts_anew(self):
        self.server.plans["uffizi_probe.hdr"] = [f"cut at {HALF}"]
        self.run_script("--retries", "0", code=1)
        self.server.requests.clear()
        self.run_script(source=self.server.address.replace("Probes", "Others"), code=0)
        self.assertEqual(self.server.requests, [("uffizi_probe.hdr", None)])
        self.assert_whole()

    def test_a_part_that_is_whole_is_not_asked_for(self):
        self.server.plans["uffizi_probe.hdr"] = [f"cut at {HALF}"]
        self.run_script("--retries", "0", code=1)
        (self.probes / "uffizi_probe.hdr.part").write_bytes(FILES["uffizi_probe.hdr"])
        self.server.requests.clear()
        self.run_script(code=0)
        self.assertEqual(self.server.requests, [])
        self.assert_whole()

    def test_a_part_whose_record_is_spoiled_is_dropped(self):
        for record in ["", "[]", "{}", '{"address": 1, "version": 2, "size": "3"}', None]:
            with self.subTest(record):
                self.probes.mkdir(exist_ok=True)
                (self.probes / "beach_probe.hdr").unlink(missing_ok=True)
                (self.probes / "beach_probe.hdr.part").write_bytes(b"spoiled")
                if record is not None:
                    (self.probes / "beach_probe.hdr.part.json").write_text(record)
                self.run_script(code=0)
                self.assert_whole()


class Wrong(Case):
    def test_a_wrong_sum(self):
        self.server.files["beach_probe.hdr"] = stand_in("not the beach")
        out, err = self.run_script(code=1)
        sentence, rest = err.splitlines()
        self.assertIn("beach_probe.hdr", sentence)
        self.assertIn(sum_of(FILES["beach_probe.hdr"]), sentence)
        self.assertIn(sum_of(self.server.files["beach_probe.hdr"]), sentence)
        self.assertIn("--from", sentence)
        self.assertIn("2 of 3", rest)
        self.assertNotIn("cargo run", out)
        self.assert_whole(TAKEN[1:])
        self.assertEqual([name for name, _ in self.server.requests], TAKEN, "it came whole: once is enough")

    def test_a_page_in_the_place_of_a_file_whose_sum_is_not_on_record(self):
        self.server.files["uffizi_probe.hdr"] = b"<html>Where it is now</html>"
        _, err = self.run_script(code=1)
        self.assertIn("uffizi_probe.hdr", err)
        self.assertIn("Radiance", err)
        self.assert_whole(TAKEN[:-1])

    def test_a_missing_file(self):
        del self.server.files["stpeters_probe.hdr"]
        _, err = self.run_script(code=1)
        self.assertIn("stpeters_probe.hdr", err.splitlines()[0])
        self.assertIn("404", err)
        self.assertEqual([name for name, _ in self.server.requests], TAKEN, "asked for once, and the others too")
        self.assert_whole(["beach_probe.hdr", "uffizi_probe.hdr"])

    def test_a_busy_server_is_asked_again_when_it_says(self):
        self.server.plans["beach_probe.hdr"] = ["status 503 1", "status 500"]
        began = time.monotonic()
        _, err = self.run_script(code=0)
        self.assertGreater(time.monotonic() - began, 1.0)
        self.assertIn("503", err)
        self.assert_whole()

    def test_a_busy_server_is_not_asked_for_ever(self):
        self.server.plans["beach_probe.hdr"] = ["status 503"] * 9
        _, err = self.run_script("--retries", "2", code=1)
        self.assertEqual([name for name, _ in self.server.requests], ["beach_probe.hdr"] * 3 + TAKEN[1:])
        self.assertIn("in 3 attempts", err)

    def test_a_silent_server(self):
        self.server.plans = {"stpeters_probe.hdr": ["silent"] * 2, "uffizi_probe.hdr": [f"stop at {HALF}", "silent"]}
        _, err = self.run_script("--timeout", "0.8", "--retries", "1", code=1)
        for name in self.server.plans:
            self.assertRegex(err, f"{name} could not be had .* in 2 attempts: the server was silent for 0.8 s")
        self.assertEqual(self.names(), ["beach_probe.hdr", "uffizi_probe.hdr.part", "uffizi_probe.hdr.part.json"])

    def test_a_server_that_drips(self):
        self.server.plans["beach_probe.hdr"] = ["drip"]
        _, err = self.run_script("--timeout", "1", "--retries", "0", code=1)
        self.assertRegex(err, r"beach_probe.hdr .* no more than \d+ bytes in 1 s")
        self.assertNotIn("beach_probe.hdr", self.names())

    def test_nobody_there(self):
        self.server.shutdown()
        self.server.server_close()
        _, err = self.run_script("--retries", "1", code=1)
        self.assertIn("beach_probe.hdr", err)
        self.assertIn("refused", err)
        # What nobody answers once is asked once for each of the others.
        self.assertEqual(err.count("the next attempt"), 1)
        self.assertEqual(self.names(), [])

    def test_chunks_that_end_early(self):
        self.server.plans["uffizi_probe.hdr"] = ["chunked cut"]
        self.run_script("--retries", "0", code=1)
        self.assert_part_only("uffizi_probe.hdr")

    def test_a_length_that_nobody_knows(self):
        self.server.plans = {name: ["no length"] for name in TAKEN}
        _, err = self.run_script(code=1)
        self.assertIn("does not say how long it is", err)
        self.assert_whole(["beach_probe.hdr"])  # whose sum tells

    def test_a_length_that_no_probe_has(self):
        self.server.plans["beach_probe.hdr"] = ["too long"]
        _, err = self.run_script(code=1)
        self.assertIn(f"beach_probe.hdr is {1 << 40} bytes long", err)
        self.assert_whole(TAKEN[1:])

    def assert_part_only(self, name):
        self.assertNotIn(name, self.names())
        self.assertIn(f"{name}.part", self.names())

    def test_a_wrong_file_that_was_there_is_put_aside(self):
        self.probes.mkdir()
        (self.probes / "beach_probe.hdr").write_bytes(b"mine")
        _, err = self.run_script(code=0)
        self.assertIn("beach_probe.hdr.wrong", err)
        self.assertEqual((self.probes / "beach_probe.hdr.wrong").read_bytes(), b"mine")
        (self.probes / "beach_probe.hdr.wrong").unlink()
        self.assert_whole()

    def test_sigint_leaves_no_final_name_and_the_next_run_goes_on(self):
        for kill, code in [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)]:
            with self.subTest(kill):
                shutil.rmtree(self.probes, ignore_errors=True)
                self.server.plans["beach_probe.hdr"] = [f"stop at {HALF}"]
                process = self.start("--timeout", "30")
                self.await_part(process, "beach_probe.hdr", HALF)
                process.send_signal(kill)
                out, err = process.communicate(timeout=20)
                self.assertEqual(process.returncode, code)
                self.assertNotIn("Traceback", err)
                self.assertNotIn("cargo run", out)
                self.assertEqual(self.names(), ["beach_probe.hdr.part", "beach_probe.hdr.part.json"])
                self.server.requests.clear()
                self.run_script(code=0)
                self.assertEqual(self.server.requests[0], ("beach_probe.hdr", f"bytes={HALF}-"))
                self.assert_whole()

    def test_a_disk_that_is_full(self):
        _, err = self.run_script(largest_file=HALF, code=1)
        self.assertEqual(err, "fetch-debevec: File too large\n")
        self.assertEqual(self.names(), ["beach_probe.hdr.part", "beach_probe.hdr.part.json"])

    def test_two_runs_at_once(self):
        self.server.plans["beach_probe.hdr"] = [f"stop at {HALF}"]
        first = self.start("--timeout", "30")
        self.await_part(first, "beach_probe.hdr", HALF)
        _, err = self.run_script(code=1)
        self.assertIn("another run", err)
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=20)


class Folders(Case):
    def setUp(self):
        super().setUp()
        self.source = self.at / "old"
        self.source.mkdir()
        for name, data in FILES.items():
            (self.source / name).write_bytes(data)

    def test_a_folder(self):
        out, err = self.run_script(source=self.source, code=0)
        self.assertEqual((err, self.server.requests), ("", []))
        self.assertIn("cargo run", out)
        self.assert_whole()

    def test_what_a_folder_lacks_is_named(self):
        (self.source / "beach_probe.hdr").unlink()
        (self.source / "uffizi_probe.hdr").unlink()
        _, err = self.run_script(source=self.source, code=1)
        self.assertEqual(re.findall(r"(\w+_probe\.hdr) is not in", err), ["beach_probe.hdr", "uffizi_probe.hdr"])
        self.assert_whole(["stpeters_probe.hdr"])

    def test_a_length_that_no_probe_has(self):
        os.truncate(self.source / "uffizi_probe.hdr", (1 << 26) + 1)
        _, err = self.run_script(source=self.source, code=1)
        self.assertIn("uffizi_probe.hdr", err)
        self.assertIn("is longer than", err)
        self.assert_whole(TAKEN[:-1])

    def test_a_wrong_sum_in_a_folder(self):
        (self.source / "beach_probe.hdr").write_bytes(FILES["beach_probe.hdr"][:-1])
        _, err = self.run_script(source=self.source, code=1)
        self.assertIn(sum_of(FILES["beach_probe.hdr"][:-1]), err)
        self.assert_whole(TAKEN[1:])

    def test_a_source_that_is_none(self):
        for source in [self.at / "nowhere", "ftp://127.0.0.1/", "http://", "http://127.0.0.1:x/", "http://a b/", "http://a/?q"]:
            with self.subTest(source):
                _, err = self.run_script(source=source, code=1)
                self.assertIn("--from", err)
                self.assertEqual(len(err.splitlines()), 1)
                self.assertFalse(self.probes.exists())

    def test_the_folder_itself(self):
        _, err = self.run_script(source=self.source, folder=f"{self.source}/.", code=1)
        self.assertIn("itself", err)

    def test_folders_that_cannot_be_written(self):
        self.probes.write_text("a file")
        for folder in [self.probes, self.probes / "deeper", "/proc/probes"]:
            with self.subTest(folder):
                _, err = self.run_script(folder=folder, code=1)
                self.assertEqual(len(err.splitlines()), 1)
                self.assertIn(str(folder), err)
        self.assertEqual(self.probes.read_text(), "a file")
        self.assertEqual(self.server.requests, [])

    @unittest.skipIf(os.geteuid() == 0, "root may write anywhere")
    def test_a_folder_without_leave_to_write(self):
        self.probes.mkdir(mode=0o555)
        _, err = self.run_script(code=1)
        self.assertIn("Permission denied", err)

    @unittest.skipUnless((ROOT / ".git").exists() and shutil.which("git"), "no repository")
    def test_the_repository_is_no_place_for_them(self):
        for folder in [ROOT / "data" / "probes-of-a-test", ROOT]:
            _, err = self.run_script(folder=folder, code=1)
            self.assertIn("may not be copied", err)
        self.assertFalse((ROOT / "data" / "probes-of-a-test").exists())

    def test_a_list_that_is_none(self):
        for text in ["x beach_probe.hdr", "- ../beach.hdr", "- a.hdr\n- a.hdr", "- beach_probe.txt"]:
            with self.subTest(text):
                self.list.write_text(text)
                _, err = self.run_script(code=1)
                self.assertIn(f"{self.list}:{text.count(chr(10)) + 1} is not", err)

    def test_a_command_line_that_cannot_be_read(self):
        for options in [["--timeout", "0"], ["--timeout", "nan"], ["--retries", "-1"], ["--stpeters", "ball"]]:
            with self.subTest(options):
                self.run_script(*options, code=2)


if __name__ == "__main__":
    unittest.main()
