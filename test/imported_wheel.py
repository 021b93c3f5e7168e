"""How an installed wheel is imported: in at most 0.2 s of the processor beside NumPy, and from which
libraries."""

import pathlib
import sys
import time

import numpy  # noqa: F401

begin = time.process_time()
import adaptive_bvh  # noqa: E402

seconds = time.process_time() - begin
mapped = {line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}
system = ("libc.", "libm.", "libz.", "libdl.", "libgcc_s.", "libpthread.", "librt.", "libstdc++.",
          "libffi.", "libutil.", "ld-linux")
inside = pathlib.Path(adaptive_bvh.__file__).parent.parent
brought = {path for path in mapped if path.startswith(f"{inside}/adaptive_bvh.libs/")}
others = {path for path in mapped - brought
          if not path.startswith((str(inside), sys.base_prefix + "/lib/python"))
          and not pathlib.Path(path).name.startswith((*system, "libpython"))}
print(f"imported in {seconds:.3f} s, with {len(brought)} libraries of its own")
assert not others, others
assert len(brought) >= 8 and seconds <= 0.2
