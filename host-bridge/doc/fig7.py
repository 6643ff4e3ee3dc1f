#!/usr/bin/env python3
"""The paper's Fig. 7 from a recording: hand, estimated wavelength and gauges over time.

    python3 -m venv target/plots
    target/plots/bin/pip install mcap mcap-ros2-support pandas matplotlib
    target/plots/bin/python host-bridge/doc/fig7.py FILE.mcap FIGURE.png [--wavelength MM] [--from S] [--to S]

Times are s since the first message. Exit status: 0 drawn, 1 nothing of it is in the recording.
"""

import argparse
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import pandas as pd
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

TOPICS = ["/display/motion", "/sensor/estimate", "/sensor/gauges"]
VOLTS_PER_CODE = 3.3 / 65_536
NS_PER_S = 1e9
GAUGES = ["g0", "g1", "g2", "g3", "g4"]
# Range T2 of the paper's equation (8): the velocity changed its sign within the window.
T2 = 1


def read(path):
    """A table of each topic, and the time of the first message in ns."""
    rows = {topic: [] for topic in TOPICS}
    start_ns = None
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, row in reader.iter_decoded_messages(topics=TOPICS):
            start_ns = start_ns or message.log_time
            at_s = (message.log_time - start_ns) / NS_PER_S
            if channel.topic == "/display/motion":
                rows[channel.topic].append({"t": at_s, "mm_s": row.velocity_um_s / 1e3})
            elif channel.topic == "/sensor/estimate":
                rows[channel.topic].append(
                    {
                        "t": at_s,
                        # NaN where there is none.
                        "wavelength_mm": row.wavelength_mm,
                        "counted_mm": row.counted_mm,
                        "valid": row.valid,
                        "t2": row.range == T2,
                        "mm_s": row.velocity_um_s / 1e3,
                    }
                )
            else:
                # Eight samples a message, 1 ms apart.
                for at, codes in enumerate(zip(*(getattr(row, gauge) for gauge in GAUGES))):
                    volts = {
                        gauge: code * VOLTS_PER_CODE for gauge, code in zip(GAUGES, codes)
                    }
                    rows[channel.topic].append({"t": at_s + at / 1e3, **volts})
    return {topic: pd.DataFrame(found) for topic, found in rows.items()}


def legend(axes, columns):
    """Above the plot, so that it hides nothing."""
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=columns, frameon=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording")
    parser.add_argument("figure")
    parser.add_argument("--wavelength", type=float, help="the true one, in mm")
    parser.add_argument("--from", dest="start", type=float, default=0.0, metavar="S")
    parser.add_argument("--to", dest="end", type=float, default=float("inf"), metavar="S")
    given = parser.parse_args()
    tables = read(given.recording)
    if any(table.empty for table in tables.values()):
        missing = [topic for topic, table in tables.items() if table.empty]
        print(f"{given.recording}: nothing on {', '.join(missing)}", file=sys.stderr)
        return 1
    within = {
        topic: table[table.t.between(given.start, given.end)] for topic, table in tables.items()
    }
    hand, estimate, gauges = (within[topic] for topic in TOPICS)

    figure, (top, middle, bottom) = plt.subplots(
        3, sharex=True, figsize=(9, 7), height_ratios=[2, 3, 3], layout="constrained"
    )
    top.plot(hand.t, hand.mm_s, label="hand")
    top.plot(estimate.t, estimate.mm_s, "--", label="arm")
    top.set_ylabel("velocity, mm/s")
    legend(top, 2)

    middle.plot(estimate.t, estimate.counted_mm, color="tab:gray", lw=0.8, label="the paper's count")
    middle.plot(
        estimate.t,
        estimate.wavelength_mm.where(estimate.valid),
        color="tab:blue",
        lw=1.8,
        label="default estimator, where valid",
    )
    if given.wavelength:
        middle.axhline(given.wavelength, color="black", ls=":", label="true")
    middle.fill_between(
        estimate.t,
        0,
        1,
        where=estimate.t2,
        transform=middle.get_xaxis_transform(),
        color="tab:red",
        alpha=0.12,
        lw=0,
        label="range T2",
    )
    likely = estimate.wavelength_mm.where(estimate.valid).max()
    middle.set_ylim(0, 2 * (given.wavelength or likely))
    middle.set_ylabel("wavelength λ, mm")
    legend(middle, 4)

    for at, gauge in enumerate(GAUGES):
        # One above the other.
        volts = gauges[gauge] - gauges[gauge].mean()
        bottom.plot(gauges.t, 1e3 * volts + 100 * at, lw=0.6, label=f"gauge {at}")
    bottom.set_ylabel("gauges, mV (100 mV apart)")
    bottom.set_xlabel("time, s")
    legend(bottom, 5)
    figure.savefig(given.figure, dpi=120)
    return 0


if __name__ == "__main__":
    sys.exit(main())
