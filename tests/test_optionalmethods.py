"""Methods that only some classes of an interface override."""

from __future__ import annotations

import pytest

from steptwin.optionalmethods import OptionalMethods


class Animal(OptionalMethods):
    def fly(self) -> None:
        raise NotImplementedError


class Bird(Animal):
    def fly(self) -> None: ...


class Sparrow(Bird): ...


def test_what_is_overridden_is_offered() -> None:
    assert not Animal().offers(Animal.fly)
    assert Bird().offers(Animal.fly)
    assert Sparrow().offers(Animal.fly)


def test_a_method_of_an_object_says_nothing() -> None:
    """It is always the one that the object has."""
    with pytest.raises(TypeError, match=r"Bird\.fly of an object"):
        Bird().offers(Bird().fly)
