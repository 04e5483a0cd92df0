#!/usr/bin/env python3
"""systemd itself checks parhelion.service: no unknown setting, and as little as possible is permitted."""
import os
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True

from unit import SKIPPED, UNIT, read_unit  # noqa: E402

MAX_EXPOSURE = 20  # tenths, of 100


def main():
    if not shutil.which("systemd-analyze"):
        print("SKIPPED: no systemd-analyze here")
        return SKIPPED
    settings = read_unit()
    with tempfile.TemporaryDirectory() as folder:
        # The program need not be installed here.
        copy = os.path.join(folder, os.path.basename(UNIT))
        with open(UNIT, encoding="utf-8") as unit, open(copy, "w", encoding="utf-8") as file:
            file.write(unit.read().replace(settings["ExecStart"][0].split()[0], "/bin/true"))
        checks = [["verify", "--man=no", copy], ["security", "--offline=yes", f"--threshold={MAX_EXPOSURE}", "--no-pager", copy]]
        failures = 0
        for check in checks:
            ran = subprocess.run(["systemd-analyze", *check], capture_output=True, text=True, check=False)
            # `verify` succeeds in spite of a setting that it does not know, and says so.
            complaints = ran.stderr.strip() if check[0] == "verify" else ""
            if ran.returncode != 0 or complaints:
                failures += 1
                print(f"systemd-analyze {' '.join(check)}: exit status {ran.returncode}\n{ran.stdout}{ran.stderr}")
        return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
