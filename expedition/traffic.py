"""What the radio's books say, as tables for the record of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from sim_world.radio.ledger import BOOKS, Tallies, Tally
from sim_world.radio.relay import Relay

Amount = dict[str, int]


def traffic_part(relay: Relay) -> dict[str, Any]:
    """Return the fields of a `RunRecord` that tell of the radio: `bytes*`, `links`, `aired`."""
    books = {
        "sent": relay.ledger.sent,
        "duplicated": relay.ledger.duplicated,
        "delivered": relay.ledger.delivered,
        "lost": relay.ledger.lost,
        "queued": relay.queued(),
    }
    aired: dict[str, dict[str, Amount]] = {}
    for (sender, kind), tally in sorted(relay.ledger.aired.items()):
        aired.setdefault(sender, {})[kind] = amount([tally])
    return {
        "bytes": summed(relay.ledger.sent, lambda key: key[2]),
        "bytes_links": summed(relay.ledger.sent, lambda key: f"{key[0]}>{key[1]}"),
        "links": links(books),
        "aired": aired,
    }


def links(books: Mapping[str, Tallies]) -> dict[str, dict[str, Any]]:
    """Return for each link `A>B` what each book holds, and in `types` the same by message type.

    Of a type only the books are told that hold something; of a link all of them.
    """
    by_link = {name: summed(books[name], lambda key: f"{key[0]}>{key[1]}") for name in BOOKS}
    told: dict[str, dict[str, Any]] = {}
    for sender, receiver, kind in sorted(dict.fromkeys(k for name in BOOKS for k in books[name])):
        link = f"{sender}>{receiver}"
        if link not in told:
            told[link] = {name: by_link[name].get(link, amount([])) for name in BOOKS}
            told[link]["types"] = {}
        key = (sender, receiver, kind)
        told[link]["types"][kind] = {n: amount([books[n][key]]) for n in BOOKS if key in books[n]}
    return told


def summed(book: Tallies, label: Callable[[tuple[str, str, str]], str]) -> dict[str, Amount]:
    """Return counts and bytes of a book, summed by a label of its keys."""
    groups: dict[str, list[Tally]] = {}
    for key, tally in book.items():
        groups.setdefault(label(key), []).append(tally)
    return {name: amount(groups[name]) for name in sorted(groups)}


def amount(tallies: Iterable[Tally]) -> Amount:
    """Return frames and bytes of some tallies together."""
    counted = list(tallies)
    return {"count": sum(t.count for t in counted), "bytes": sum(t.bytes for t in counted)}
