"""Hash of the tool's own sources, so that results of two editions are never mixed."""

from __future__ import annotations

from functools import lru_cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

PACKAGES = {"tyrecal": "*.py", "tyrecal_solvers": "*.py", "tyrecal_templates": "*.j2"}


@lru_cache(maxsize=1)
def sources() -> str:
    """Hash of all Python files and templates of the tool and its solvers, 64 hexadecimal digits."""
    digest = sha256()
    for package, pattern in PACKAGES.items():
        root = Path(str(files(package)))
        for path in sorted(root.rglob(pattern)):
            digest.update(f"{package}/{path.relative_to(root).as_posix()}\0".encode())
            digest.update(sha256(path.read_bytes()).digest())
    return digest.hexdigest()
