# %% From a recording to a cleaned map, and to the page that shows it in this notebook.
import sys
import tempfile
from pathlib import Path

import dynains

folder = Path(tempfile.mkdtemp())
if len(sys.argv) == 2:  # a folder of scans or a log
    diagnosis = dynains.check(sys.argv[1])
    print(diagnosis)
    recording = dynains.Recording(sys.argv[1], **diagnosis.options)
else:
    dynains.Simulator("urban", "vlp16", scans=15).write(folder / "street")
    recording = dynains.Recording(folder / "street")
result = dynains.run(recording, folder / "cleaned", view=True)
print(result, result.label_counts, result.static_map)

# %% The page of the run: in a notebook, the last value of a cell is shown.
dynains.view(result)
