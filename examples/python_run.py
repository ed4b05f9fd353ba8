# %% From a recording to a cleaned map, and to the page that shows it in this notebook.
import sys
import tempfile

import dynains

# A folder of scans or a log; else the street of README.md.
path = sys.argv[1] if len(sys.argv) == 2 else "build/street"
diagnosis = dynains.check(path)
print(diagnosis)
recording = dynains.Recording(path, **diagnosis.options)
result = dynains.run(recording, tempfile.mkdtemp() + "/cleaned", view=True)
print(result, result.label_counts, result.static_map)

# %% The page of the run: in a notebook, the last value of a cell is shown.
dynains.view(result)
