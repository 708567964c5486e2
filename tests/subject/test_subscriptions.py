"""Followers: what they want, in order, at most so many, and how many were missed."""

from __future__ import annotations

from steptwin.motion.profile import at_rest
from steptwin.subject.events import Event
from steptwin.subject.payloads import EdgePayload, FramePayload, NotePayload, PlanPayload, StatusPayload
from steptwin.subject.subscriptions import EventBatch, Subscription, Subscriptions, filter_of

EDGE = EdgePayload("IN1", 1.0)


def event(number: int, payload: object = EDGE, controller: str = "a") -> Event:
    return Event(number, number, controller, payload)  # type: ignore[arg-type]


def test_events_come_in_order_and_once() -> None:
    subscribers = Subscriptions()
    subscription = subscribers.subscribe(filter_of(), 10)
    subscribers.publish(event(1))
    subscribers.publish(event(2))
    assert subscription.take() == EventBatch(0, [event(1), event(2)])
    assert subscription.take() == EventBatch(0, [])


def test_beyond_the_bound_the_oldest_are_dropped_and_counted() -> None:
    subscribers = Subscriptions()
    slow, quick = subscribers.subscribe(filter_of(), 2), subscribers.subscribe(filter_of(), 10)
    for number in range(5):
        subscribers.publish(event(number))
    assert slow.take() == EventBatch(3, [event(3), event(4)])
    assert slow.take() == EventBatch(0, [])
    assert quick.take() == EventBatch(0, [event(number) for number in range(5)])


def test_part_of_what_waits_can_be_taken() -> None:
    subscribers = Subscriptions()
    subscription = subscribers.subscribe(filter_of(), 3)
    for number in range(4):
        subscribers.publish(event(number))
    assert subscription.take(2) == EventBatch(1, [event(1), event(2)])
    assert len(subscription) == 1


def test_only_what_is_wanted_comes() -> None:
    subscribers = Subscriptions()
    usual = subscribers.subscribe(filter_of(), 9)
    frames = subscribers.subscribe(filter_of(["frame"]), 9)
    of_b = subscribers.subscribe(filter_of(controllers=["b"]), 9)
    of_axis = subscribers.subscribe(filter_of(axes=["2"]), 9)
    one, two = PlanPayload("1", at_rest(0, 0)), PlanPayload("2", at_rest(0, 0))
    events = [
        event(1, FramePayload("tcp-1", "in", b"\1")),
        event(2, one),
        event(3, two, "b"),
        event(4, NotePayload("x"), "world"),
        event(5, StatusPayload("limit", "M1 stopped by KL", (("axis", 1),))),
    ]
    for each in events:
        subscribers.publish(each)
    numbers = [[each.number for each in subscription.take().events] for subscription in (usual, frames, of_b, of_axis)]
    assert numbers == [[2, 3, 4, 5], [1], [3], [3, 4]]


def test_who_waits_is_called_once_for_what_has_come() -> None:
    subscribers = Subscriptions()
    subscription = subscribers.subscribe(filter_of(), 9)
    calls: list[int] = []
    subscription.on_event = lambda: calls.append(len(subscription))
    subscribers.publish(event(1))
    subscribers.publish(event(2))
    subscription.take()
    subscribers.publish(event(3))
    assert calls == [1, 1]


def test_closed_followers_get_nothing_more_and_nobody_is_followed_then() -> None:
    changes: list[frozenset[str]] = []
    subscribers = Subscriptions(lambda: changes.append(subscribers.kinds))
    subscription: Subscription = subscribers.subscribe(filter_of(["edge"]), 9)
    subscribers.publish(event(1))
    subscription.close()
    subscription.close()
    subscribers.publish(event(2))
    assert subscription.take().events == [event(1)]
    assert not subscribers.all
    assert changes == [frozenset({"edge"}), frozenset()]


def test_what_was_lost_on_its_way_is_counted() -> None:
    subscription = Subscriptions().subscribe(filter_of(), 9)
    subscription.miss(3)
    assert subscription.take() == EventBatch(3, [])
