"""MJWarp drops constraints of contacts that another detector gives it: the default of njmax_nnz counts the pairs
that MJWarp's own detection would find. A minimal example, without tesdf.

    pip install mujoco==4.0.0 mujoco-warp==4.0.0
    python lab/scripts/mjwarp_dropped_rows.py

A box rests on a plane. MJWarp gets the contacts of MuJoCo, for geoms that it does not collide itself. With the
default of make_data it drops their rows, prints a warning in a kernel, and the box falls through the plane.
"""

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

MODEL = """
<mujoco>
  <option timestep="0.002" jacobian="sparse" cone="elliptic"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1" contype="{bit}" conaffinity="{bit}"/>
    <body pos="0 0 0.0999"><freejoint/><geom type="box" size="0.1 0.1 0.1" contype="{bit}" conaffinity="{bit}"/></body>
  </worldbody>
</mujoco>"""


def rows_of(**room):
    """Rows of constraints in MJWarp, rows in MuJoCo, and whether MJWarp's data says that some are missing."""
    collides = mujoco.MjModel.from_xml_string(MODEL.format(bit=1))
    expected = mujoco.MjData(collides)
    mujoco.mj_forward(collides, expected)
    model = mujoco.MjModel.from_xml_string(MODEL.format(bit=0))
    m = mjw.put_model(model)
    d = mjw.make_data(model, nconmax=8, njmax=64, **room)
    m.opt.run_collision_detection = False
    mjw.fwd_position(m, d)
    count = expected.ncon
    same = ("dist", "pos", "frame", "friction", "solref", "solreffriction", "solimp", "dim", "geom")
    rows = {name: np.array(getattr(expected.contact, name)) for name in same}
    rows.update(worldid=np.zeros(count), type=np.ones(count), includemargin=np.zeros(count))
    for name, array in rows.items():
        target = getattr(d.contact, name)
        given = np.ascontiguousarray(array, np.int32 if target.dtype in (wp.int32, wp.vec2i) else np.float32)
        wp.copy(target, wp.array(given, dtype=target.dtype, device="cpu"), count=count)
    d.nacon.fill_(count)
    mjw.make_constraint(m, d)
    missing = bool(d.overflow.numpy()[0] & int(mjw.OverflowType.NJMAX_NNZ))
    full = int(np.count_nonzero(d.efc.J_rownnz.numpy()[0, : expected.nefc]))
    return full, expected.nefc, missing


for name, room in (("njmax_nnz = njmax * nv", {"njmax_nnz": 64 * 6}), ("the default of njmax_nnz", {})):
    full, rows, missing = rows_of(**room)
    print(f"{name}: {full} of {rows} rows{', and d.overflow says so' if missing else ''}")
    assert full == rows, "the rows of contacts are dropped"
