"""The hour's airtime over restarts of the vessel, whatever protocol and profile it is started with."""

import json

import pytest

from companion.facade import Shared
from companion.io.keeping.content import SaveValue
from companion.io.keeping.store import MemoryStore
from companion.radio import MEMORY_KEY, radio_conversation
from companion.settings.schema import Settings
from tools.lora_rig import KEY, BookVessel


@pytest.fixture
def start(tmp_path):
    """Start the radio's protocol on a store that outlives it."""
    key = tmp_path / "radio.key"
    key.write_bytes(KEY)
    key.chmod(0o600)
    store = MemoryStore()

    shared = Shared(lambda severity, text: None)

    def make(protocol, profile):
        store.completions()
        settings = Settings()
        radio = settings.radio.model_copy(update={"protocol": protocol, "profile": profile, "key_file": str(key)})
        return radio_conversation(settings.model_copy(update={"radio": radio}), BookVessel(), store, shared)(0, "")

    make.store = store
    return make


def transmit(talk, seconds):
    """Note so much airtime, a second at a time."""
    now_us = 0
    for _ in range(seconds):
        now_us += 2_000_000
        talk.ledger.charge(1_000_000, now_us)


def used_s(talk):
    return talk.ledger.used_us(0) * 1e-6


@pytest.mark.parametrize("first", ["compact", "json"])
@pytest.mark.parametrize("then", ["compact", "json"])
def test_another_protocol_finds_the_hour_as_it_was_left(start, first, then):
    transmit(start(first, "o-10"), 200)
    assert 195.0 < used_s(start(then, "o-10")) < 215.0


def test_what_was_sent_without_a_limit_counts_for_a_profile_with_one(start):
    transmit(start("compact", "o-10"), 100)
    transmit(start("compact", "bench"), 100)
    assert 190.0 < used_s(start("compact", "o-10")) < 220.0


@pytest.mark.parametrize("protocol", ["compact", "json"])
def test_the_hour_that_earlier_software_kept_counts_once(start, protocol):
    fields = {"tx": 9, "rx": 9, "id": 1, "session": 1, "other": 2, "known": [], "air": [[60, 150_000_000]]}
    start.store.submit(SaveValue(MEMORY_KEY, json.dumps(fields)))
    for _ in range(3):
        assert 149.0 < used_s(start(protocol, "o-10")) < 165.0
