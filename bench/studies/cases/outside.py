"""Writes outside.csv: the motion of a hoist's chain of rigid segments in MuJoCo, the reference of outside.toml.

    pip install mujoco==4.0.0 numpy
    python outside.py

MuJoCo (Apache-2.0, https://mujoco.org) has the angles of the ball joints as its coordinates: joints are rigid exactly,
no multiplier is solved for, no constraint is stabilised, and none of it is shared with taut. It steps by RK4. The time
error is found by halving: the motion that is written is compared with one of twice the step, and its own error is a
sixteenth of the difference. The script fails where the difference exceeds 1e-8 m, or where the energy changes by more
than 1e-9 of the motion's.
"""

from pathlib import Path

import mujoco
import numpy as np

SEGMENTS = 8  # of 1 m and 1 kg, below each other; the load hangs from the last
INTERVAL, ROWS = 0.05, 61  # s
STEPS = 400  # in an interval
START = [0.3, -0.5, 0.0]  # angular velocity of all about the uppermost joint, rad/s
SPIN = [0.0, 0.0, 0.6]  # of the load beside the last segment, rad/s


def chain(dt):
    segment = '<joint type="ball"/><inertial pos="0 0 -0.5" mass="1" diaginertia="0.085 0.085 0.004"/>'
    load = '<joint type="ball"/><inertial pos="0.1 0 -1.2" mass="1000" diaginertia="300 400 200"/>'
    tree = f'<body pos="0 0 -1">{load}</body>'
    for k in reversed(range(SEGMENTS)):
        tree = f'<body pos="0 0 {-min(k, 1)}">{segment}{tree}</body>'
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt}" integrator="RK4" gravity="0 0 -9.81"><flag energy="enable"/></option>'
        f"<worldbody>{tree}</worldbody></mujoco>"
    )


def motion(steps):
    """Centres of mass of the fourth segment, the eighth and the load (m), row by row, and the energies (J)."""
    model = chain(INTERVAL / steps)
    data = mujoco.MjData(model)
    data.qvel[:3], data.qvel[-3:] = START, SPIN
    mujoco.mj_forward(model, data)
    places, energies = [], []
    for row in range(ROWS):
        for _ in range(steps if row else 0):
            mujoco.mj_step(model, data)
        # Places and energies belong to the end of the step.
        mujoco.mj_forward(model, data)
        places.append(data.xipos[[4, 8, 9]].ravel().copy())
        energies.append(data.energy.copy())
    return np.array(places), np.array(energies)


coarse, _ = motion(STEPS // 2)
places, energies = motion(STEPS)
apart = np.abs(places - coarse).max()
drift = np.ptp(energies.sum(axis=1)) / energies[:, 1].max()
print(f"MuJoCo {mujoco.__version__}: {apart:.1e} m from twice the step, energy within {drift:.1e}")
assert apart < 1e-8 and drift < 1e-9
bodies = ["segment_4", "segment_8", "load"]
heading = ["time"] + [f"{body}.{axis}" for body in bodies for axis in "xyz"]
lines = [",".join(heading)]
for row, place in enumerate(places):
    lines.append(",".join([f"{row * INTERVAL:.2f}"] + [f"{x:.10f}" for x in place]))
Path(__file__).with_suffix(".csv").write_text("\n".join(lines) + "\n")
