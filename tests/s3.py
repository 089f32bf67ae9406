"""A server on this machine that speaks S3 over HTTP: moto's, in a process of its own."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

BUCKET = "plants"


class S3Server:
    """A context manager. `environment` is what points clients to it; `answers()` what it was asked for."""

    def __init__(self, log: Path):
        self.log = log

    def __enter__(self) -> S3Server:
        with self.log.open("wb") as out:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", "0"], stdout=out, stderr=out
            )
        while (found := re.search(r"http://127\.0\.0\.1:\d+", self.log.read_text())) is None:
            assert self._process.poll() is None, self.log.read_text()
            time.sleep(0.02)
        self.environment = {
            "AWS_ENDPOINT_URL": found[0],
            "AWS_ACCESS_KEY_ID": "me",
            "AWS_SECRET_ACCESS_KEY": "hush",
            "AWS_DEFAULT_REGION": "us-east-1",
        }
        return self

    def __exit__(self, *_) -> None:
        self._process.kill()
        self._process.wait()

    def put(self, files: dict[str, bytes]) -> str:
        """Puts files into an empty bucket; its URL."""
        system = self.system()
        if system.exists(BUCKET):
            system.rm(BUCKET, recursive=True)
        system.mkdir(BUCKET)
        for name, data in files.items():
            system.pipe_file(f"{BUCKET}/{name}", data)
        return f"s3://{BUCKET}"

    def system(self):
        import fsspec

        return fsspec.filesystem("s3", skip_instance_cache=True, use_listings_cache=False)

    def answers(self) -> list[str]:
        """Method, path and status of each request so far."""
        found = re.findall(r'"\S*?([A-Z]+ /\S*) HTTP/1\.1\S*" (\d+)', self.log.read_text())
        return [" ".join(row) for row in found]
