"""tyrecal: calibrates tyre finite element models to measured modes.

>>> import tyrecal
>>> case = tyrecal.load_case("cases/p235_75r17.yaml", mesh="coarse")
>>> for mode in tyrecal.evaluate_modes(case)[:3]:
...     print(f"{mode.label}: {mode.frequency_Hz:.1f} Hz")
[0,0] axial: 37.0 Hz
[0,0] torsional: 38.1 Hz
[1,1]: 43.5 Hz

What is offered stands in ``tyrecal.api``, which is imported when something of it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .version import __version__ as __version__

if TYPE_CHECKING:
    from .api import *  # noqa: F403  the names of its __all__
    from .api import __all__ as __all__
else:

    def __getattr__(name: str) -> Any:
        if name == "__all__" or not name.startswith("_"):  # Python itself looks for __path__ ...
            api = import_module("tyrecal.api")
            if name == "__all__" or name in api.__all__:
                return getattr(api, name)
        raise AttributeError(f"module 'tyrecal' has no attribute '{name}'")

    def __dir__() -> list[str]:
        return [*globals(), *import_module("tyrecal.api").__all__]
