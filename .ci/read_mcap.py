"""Reads recordings with the reference MCAP reader: see read-mcap."""

import json
import sys
from collections import Counter

from mcap.reader import make_reader

# Channel, and the field that counts up by one.
COUNTED = {
    "/sensor/gauges": "sample",
    "/sensor/estimate": "sequence",
    "/display/motion": "sequence",
}


def complaints(path, in_log_time_order):
    """Reads a file; yields what is wrong with it, and prints what is in it."""
    counts, last, gaps, lost = Counter(), {}, Counter(), Counter()
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            yield "has no summary: it was cut off"
            return
        for schema, channel, message in reader.iter_messages(log_time_order=in_log_time_order):
            counts[channel.topic] += 1
            if schema is None or (schema.encoding, channel.message_encoding) != ("jsonschema", "json"):
                yield f"{channel.topic}: no JSON with a schema"
                return
            row = json.loads(message.data)
            missing = set(json.loads(schema.data)["required"]) - row.keys()
            if missing:
                yield f"{channel.topic}: without {', '.join(sorted(missing))}"
            field = COUNTED.get(channel.topic)
            if field is None:
                continue
            number, before = row[field], last.get(channel.topic)
            last[channel.topic] = number
            if before is None:
                continue
            if number <= before:
                yield f"{channel.topic}: {field} {number} after {before}"
            elif number > before + 1:
                gaps[channel.topic] += 1
                lost[channel.topic] += number - before - 1
        told = summary.statistics.message_count
    if told != sum(counts.values()):
        yield f"the summary tells of {told} messages, {sum(counts.values())} are there"
    if in_log_time_order:
        for topic in sorted(counts):
            gap = f", {lost[topic]} missing in {gaps[topic]} gaps" if gaps[topic] else ""
            print(f"{path}: {topic}: {counts[topic]}{gap}")


def main(paths):
    wrong = 0
    for path in paths:
        for in_log_time_order in (True, False):
            for count, complaint in enumerate(complaints(path, in_log_time_order)):
                wrong += 1
                if count < 10:
                    print(f"{path}: {complaint}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
