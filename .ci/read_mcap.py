"""Reads recordings with three readers of others: see read-mcap."""

import math
import sys
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

# Channel, the field that counts up, and by how much a message does.
COUNTED = {
    "/sensor/gauges": ("first_sample", 8),
    "/sensor/estimate": ("sequence", 1),
    "/display/motion": ("sequence", 1),
}
# EVENT_RESTARTED of a board's link.
RESTARTED = 1


def values(message):
    """Every value of a message, with those of messages within it, in order."""
    names = getattr(message, "__dataclass_fields__", None) or message.__slots__
    for name in names:
        # rosbags has a message's constants among its fields.
        if name.startswith("_") or name.isupper():
            continue
        yield from flat(getattr(message, name))


def flat(value):
    if isinstance(value, (bool, int, float, str)):
        # NaN equals nothing, itself included.
        yield "NaN" if isinstance(value, float) and math.isnan(value) else value
    elif hasattr(value, "tolist"):
        yield from flat(value.tolist())
    elif isinstance(value, (list, tuple, bytes)):
        for item in value:
            yield from flat(item)
    else:
        yield from values(value)


def by_mcap(path, in_log_time_order):
    """Topic, time and message, by mcap and mcap-ros2-support."""
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header, summary = reader.get_header(), reader.get_summary()
        if summary is None or summary.statistics is None:
            raise ValueError("has no summary: it was cut off")
        if header.profile != "ros2":
            raise ValueError(f"has the profile {header.profile!r}: is no recording of ROS 2")
        count = 0
        for schema, channel, message, decoded in reader.iter_decoded_messages(
            log_time_order=in_log_time_order
        ):
            if (schema.encoding, channel.message_encoding) != ("ros2msg", "cdr"):
                raise ValueError(f"{channel.topic}: no CDR with ros2msg")
            if message.publish_time != message.log_time:
                raise ValueError(f"{channel.topic}: two times for one message")
            count += 1
            yield channel.topic, message.log_time, decoded
        if count != summary.statistics.message_count:
            told = summary.statistics.message_count
            raise ValueError(f"the summary tells of {told} messages, {count} are there")


def by_rosbags(path):
    """The same by rosbags."""
    with AnyReader([Path(path)]) as reader:
        for connection, time, data in reader.messages():
            yield connection.topic, time, reader.deserialize(data, connection.msgtype)


def look(messages, digests):
    """Yields what is wrong with a file's messages; counts them, what is missing, and what they hold."""
    last, backwards, starts = {}, {}, Counter()
    for topic, time, message in messages:
        digests[topic, "messages"] += 1
        # Whatever the order between channels, it is the same sum.
        digests[topic, "values"] = (
            digests[topic, "values"] + hash((time, *values(message)))
        ) % (1 << 61)
        if topic.endswith("/link") and message.event == RESTARTED:
            starts[topic.removesuffix("link")] += 1
        if topic not in COUNTED:
            continue
        field, step = COUNTED[topic]
        number = getattr(message, field)
        before = last.get(topic)
        last[topic] = number
        if before is None:
            continue
        if number < before + step:
            backwards.setdefault(topic, []).append(f"{topic}: {field} {number} after {before}")
        elif number > before + step:
            digests[topic, "gaps"] += 1
            digests[topic, "missing"] += number - before - step
    # A board that has started anew counts anew, and its link says that it has.
    for topic, steps in backwards.items():
        yield from steps[starts[topic[: topic.rindex("/") + 1]] :]


def main(paths):
    wrong = 0

    def complain(text):
        nonlocal wrong
        wrong += 1
        if wrong < 10:
            print(text, file=sys.stderr)

    for path in paths:
        found = []
        for name, messages in (
            ("mcap", by_mcap(path, True)),
            ("mcap, as written", by_mcap(path, False)),
            ("rosbags", by_rosbags(path)),
        ):
            digests = Counter()
            found.append(digests)
            try:
                for complaint in look(messages, digests):
                    complain(f"{path}: {name}: {complaint}")
            except Exception as error:  # a reader's own, of whatever kind
                complain(f"{path}: {name}: {error!r}")
            if digests != found[0]:
                complain(f"{path}: {name} finds other messages than mcap does")
        first = found[0]
        for topic in sorted({topic for topic, _ in first}):
            missing, gaps = first[topic, "missing"], first[topic, "gaps"]
            gap = f", {missing} missing in {gaps} gaps" if gaps else ""
            print(f"{path}: {topic}: {first[topic, 'messages']} messages{gap}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
