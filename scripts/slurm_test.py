#!/usr/bin/env python3
"""All pairs of ten made shapes through a Slurm that loses a node and its controller on the way.

    python3 scripts/slurm_test.py [--binary PATH] [--keep FOLDER]

Starts munge, a controller and three nodes on this machine, in a folder of their own, and ends them. It needs the
packages slurm-wlm and munge, and root. Then:

1. the 45 pairs are submitted as an array of nine tasks; those that run receive the signal that comes shortly before a
   time limit, so that each ends with a checkpoint and puts itself into the queue again;
2. a node is killed with its tasks, and later the controller, which is started again; Slurm then holds tasks back that it
   finds twice, or forgets them, and the same command submits what is left;
3. a second array is cancelled, and must stay so;
4. at the end every run must be done, and its field and its surfaces equal, to the last bit, to those of
   `isomorph batch run` on the same jobs, which was killed twice itself.
"""

import argparse
import hashlib
import json
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NODES = ("n1", "n2", "n3")
SHAPES = 10

CONFIG = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=cred_expire=5
SlurmctldPort=26817
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/log/slurmctld.log
SlurmdLogFile={folder}/log/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
SlurmdTimeout=10
SlurmctldTimeout=10
InactiveLimit=0
KillWait=5
MinJobAge=300
JobRequeue=1
SchedulerParameters=batch_sched_delay=0,sched_interval=2,bf_interval=2
MpiDefault=none
{nodes}
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Cluster:
    """A Slurm of three nodes on this machine."""

    def __init__(self, folder: Path):
        self.folder = folder
        host = socket.gethostname().split(".")[0]
        for name in ("state", "log", *(f"spool/{node}" for node in NODES)):
            (folder / name).mkdir(parents=True)
        nodes = "\n".join(
            f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={26821 + k} CPUs=2"
            " RealMemory=4000 State=UNKNOWN"
            for k, node in enumerate(NODES)
        )
        config = folder / "slurm.conf"
        config.write_text(CONFIG.format(folder=folder, host=host, nodes=nodes))
        self.env = os.environ | {"SLURM_CONF": str(config)}
        self.munged = None

    def call(self, *words: str, check: bool = True) -> str:
        ended = subprocess.run(
            words, env=self.env, check=False, capture_output=True, text=True, timeout=60
        )
        if check and ended.returncode:
            raise SystemExit(f"{' '.join(words)}: {ended.stderr.strip()}")
        return ended.stdout

    def start(self) -> None:
        subprocess.run(
            ["install", "-d", "-o", "munge", "-g", "munge", "-m", "755", "/run/munge"], check=True
        )
        key = Path("/etc/munge/munge.key")
        if not key.exists():
            key.write_bytes(os.urandom(1024))
            key.chmod(0o400)
            shutil.chown(key, "munge", "munge")
        if subprocess.run(["pidof", "munged"], capture_output=True, check=False).returncode:
            user = ["runuser", "-u", "munge", "--"]
            command = [*user, "/usr/sbin/munged", "--foreground"]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            self.munged = subprocess.Popen(command, **quiet)
            time.sleep(1)
        self.call("slurmctld", "-i")
        for node in NODES:
            self.call("slurmd", "-N", node)
        until("all nodes idle", 30, lambda: self.call("sinfo", "-h", "-o", "%D %t") == "3 idle\n")

    def controller(self) -> int:
        return int((self.folder / "slurmctld.pid").read_text())

    def kill_controller(self) -> None:
        os.kill(self.controller(), signal.SIGKILL)
        time.sleep(1)
        self.call("slurmctld")

    def kill_node(self, node: str) -> None:
        """As by a loss of power: the daemon, its steps and their work at once."""
        doomed = {int((self.folder / f"slurmd-{node}.pid").read_text())}
        own = f"SLURMD_NODENAME={node}".encode()
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                words = (entry / "environ").read_bytes().split(b"\0")
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, ValueError):
                continue
            if own in words:
                doomed.add(int(entry.name))
                step = Path(f"/proc/{parent}/cmdline")
                if step.exists() and b"slurmstepd" in step.read_bytes():
                    doomed.add(parent)
        for process in doomed:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass

    def queue(self) -> list[str]:
        return self.call("squeue", "-h", "-r", "-o", "%i %t").splitlines()

    def end(self) -> None:
        self.call("scancel", "--user=root", check=False)
        for file in (*self.folder.glob("slurmd-*.pid"), self.folder / "slurmctld.pid"):
            try:
                os.kill(int(file.read_text()), signal.SIGTERM)
            except (OSError, ValueError):
                pass
        if self.munged:
            self.munged.terminate()
        time.sleep(1)


def until(what: str, seconds: float, is_so) -> None:
    """Waits, and fails with a sentence."""
    end = time.monotonic() + seconds
    while not is_so():
        if time.monotonic() > end:
            raise SystemExit(f"not so after {seconds:.0f} s: {what}")
        time.sleep(0.5)


def write_shapes(folder: Path) -> None:
    """Spheres that are longer and more bent from one to the next."""
    folder.mkdir(parents=True)
    rings, around = 12, 24
    faces = []
    for i in range(rings):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            faces += [(a, a + around, b), (b, a + around, b + around)]
    for k in range(SHAPES):
        lines = []
        for i in range(rings + 1):
            polar = math.pi * i / rings
            for j in range(around):
                angle = math.tau * j / around
                x, y = math.sin(polar) * math.cos(angle), math.sin(polar) * math.sin(angle)
                z = math.cos(polar)
                lines.append(f"v {x * (1 + 0.05 * k):.6f} {y:.6f} {z + 0.05 * k * x * x:.6f}")
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        (folder / f"shape-{k}.obj").write_text("\n".join(lines) + "\n")


def write_jobs(folder: Path, name: str) -> Path:
    path = folder / f"{name}.toml"
    keys = {
        "result.frames": 2,
        "result.resolution": 40,
        "data.points": 1000,
        "data.correspondences": "same-vertices",
        "spline.band": 3000,
        "training.steps": 40,
        "checkpoint.every": 5,
    }
    listed = ", ".join(f'"{key}={value}"' for key, value in keys.items())
    path.write_text(f'folder = "{name}"\nset = [{listed}]\n[all-pairs]\nfiles = "shapes/*.obj"\n')
    return path


def states(binary: str, jobs: Path) -> list[dict]:
    said = subprocess.run(
        [binary, "batch", "status", str(jobs), "--json"], check=True, capture_output=True, text=True
    )
    return [json.loads(line) for line in said.stdout.splitlines()]


def done(binary: str, jobs: Path) -> int:
    return sum(job["state"] == "done" for job in states(binary, jobs))


def logs(jobs: Path) -> str:
    """What the tasks of an array have said."""
    files = (jobs.parent / jobs.stem / "slurm").glob("*.log")
    return "".join(file.read_text() for file in files)


def digest(run: Path) -> str:
    """Of what a run has found: its field, and its surfaces."""
    newest = sorted((run / "checkpoints").iterdir())[-1]
    files = [newest / "velocity.mpk", *sorted((run / "meshes").glob("*.ply"))]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def finish(cluster: Cluster, binary: str, jobs: Path, submit: list[str]) -> None:
    """Waits for all runs. Where Slurm has nothing to do any more and runs are left, they are submitted again."""
    end = time.monotonic() + 240
    idle = 0
    while done(binary, jobs) < 45:
        if time.monotonic() > end:
            print(cluster.call("squeue", "-r", check=False), flush=True)
            raise SystemExit("not so after 240 s: all runs are done")
        # Held back: "launch failed requeued held"; those that merely wait have other reasons.
        listed = cluster.call("squeue", "-h", "-r", "-o", "%t %r", check=False).splitlines()
        busy = [line for line in listed if "held" not in line]
        idle = 0 if busy else idle + 1
        if idle == 4:
            cluster.call("scancel", "--user=root", check=False)
            print("again:", cluster.call(*submit), end="", flush=True)
            idle = 0
        time.sleep(1)


def killed_twice(binary: str, jobs: Path) -> None:
    """The same jobs on this machine, killed in the middle twice."""
    command = [binary, "batch", "run", str(jobs), "--jobs", "2", "--quiet"]
    for seconds in (3, 5, None):
        work = subprocess.Popen(command, start_new_session=True)
        try:
            if work.wait(seconds):
                raise SystemExit(f"batch run ended with {work.returncode}")
        except subprocess.TimeoutExpired:
            os.killpg(work.pid, signal.SIGKILL)
            work.wait()


def main(words: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=str(ROOT / "target/release/isomorph"))
    parser.add_argument("--keep", type=Path, help="leave everything in this folder")
    options = parser.parse_args(words)
    for program in ("slurmctld", "slurmd", "munged", "sbatch"):
        if not shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin"):
            raise SystemExit(f"{program}: is not here; apt-get install slurm-wlm munge")
    begun = time.monotonic()

    def said(text: str) -> None:
        print(f"[{time.monotonic() - begun:5.1f} s] {text}", flush=True)

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as temporary:
        folder = options.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        write_shapes(folder / "shapes")
        here, there, cancelled = (write_jobs(folder, name) for name in ("here", "there", "cancelled"))
        cluster = Cluster(folder / "cluster")
        try:
            cluster.start()
            said("Slurm runs")
            limits = ["--array-size", "9", "--time", "10", "--grace", "60", "--cpus", "1"]
            submit = [options.binary, "batch", "submit"]
            print(cluster.call(*submit, str(there), *limits), end="", flush=True)
            until("a few runs are done", 60, lambda: done(options.binary, there) >= 3)
            running = [line.split()[0] for line in cluster.queue() if line.endswith(" R")]
            cluster.call("scancel", "--batch", "--signal=USR1", *running, check=False)
            said(f"{len(running)} tasks were signalled as before their time limits")
            until("a task has ended with a checkpoint", 60, lambda: "JOB REQUEUE" in logs(there))
            cluster.kill_node("n1")
            said("node n1 was killed with its tasks")
            time.sleep(4)
            cluster.kill_controller()
            said("the controller was killed and started again")
            cluster.call("slurmd", "-N", "n1")
            finish(cluster, options.binary, there, [*submit, str(there), *limits])
            said("all 45 runs are done")
            cluster.call("scancel", "--user=root", check=False)
            print(cluster.call(*submit, str(cancelled), *limits), end="", flush=True)
            until(
                "a run of the second array is running",
                60,
                lambda: any(job["state"] == "running" for job in states(options.binary, cancelled)),
            )
            cluster.call("scancel", "--user=root")
            until("the queue is empty", 30, lambda: not cluster.queue())
            count = done(options.binary, cancelled)
            time.sleep(8)
            if cluster.queue() or done(options.binary, cancelled) != count or count == 45:
                raise SystemExit("a cancelled array went on")
            said(f"the second array stays cancelled, with {count} runs done")
        except SystemExit:
            print(cluster.call("squeue", "-r", check=False), flush=True)
            raise
        finally:
            cluster.end()
        killed_twice(options.binary, here)
        said("the same jobs were done here, killed twice on the way")
        rows = []
        for jobs in (here, there):
            subprocess.run(
                [options.binary, "batch", "collect", str(jobs)], check=True, stdout=subprocess.DEVNULL
            )
            found = json.loads((folder / jobs.stem / "results.json").read_text())
            rows.append([(job["name"], job["state"], job["step"], job["total"]) for job in found])
        if rows[0] != rows[1] or len(rows[0]) != 45:
            raise SystemExit("the tables of both differ")
        for name, *_ in rows[0]:
            if digest(folder / "here" / name) != digest(folder / "there" / name):
                raise SystemExit(f"{name}: the run through Slurm is another one than that of this machine")
        said("every run equals that of this machine, to the last bit")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
