"""`tyrecal blind make` by another maker than the diagnosis' own model:

python -m tests.blind calculix DIR --case cases/p235_75r17.yaml --effects 300
python -m tests.blind bundled DIR --case cases/p235_75r17.yaml
"""

from __future__ import annotations

import sys
from functools import partial
from unittest.mock import patch

from tyrecal.cli.main import main

from .makers import other_maker

if __name__ == "__main__":
    solver, *rest = sys.argv[1:]
    with patch("tyrecal.studies.blind.maker.bundled_maker", partial(other_maker, solver)):
        main(["blind", "make", *rest])
