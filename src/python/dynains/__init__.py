import html as _html
import pathlib as _pathlib

from . import _dynains
from ._dynains import *  # noqa: F403
from ._dynains import __version__  # noqa: F401

__doc__ = _dynains.__doc__


class View:
    """Page that shows the results of a run: in a notebook the page itself, elsewhere its path."""

    def __init__(self, path, height=600):
        self._path = _pathlib.Path(path)
        self._height = height

    @property
    def path(self):
        """File of the page, which any browser opens."""
        return self._path

    @property
    def height(self):
        """Height in a notebook, in pixels."""
        return self._height

    def __fspath__(self):
        return str(self._path)

    def __repr__(self):
        return f"<dynains.View: {self._path}>"

    def _repr_html_(self):
        page = _html.escape(self._path.read_text(encoding="utf-8"))
        style = f"width: 100%; height: {self._height}px; border: 0"
        return f'<iframe srcdoc="{page}" style="{style}"></iframe>'


def view(out, recording=None, max_points=1000000, height=600):
    """Writes the page view.html into a folder of results, and returns it as a View.

    out: folder of run() or `dynains run`, or a RunResult. recording: a Recording or its path; by
    default that of the run, with the options of the run. max_points: points on the page; larger
    maps are thinned. height: in a notebook, in pixels. Raises IoError if the folder has no complete
    results or the recording is not found.
    """
    folder = out.folder if isinstance(out, _dynains.RunResult) else out
    return View(_dynains._write_page(folder, recording, max_points), height)
