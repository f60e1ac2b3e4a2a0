"""Services whose answer comes later than the call: when the requested action is done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

_DEFERRED = object()


class DeferredService:
    """A service that may keep its callers waiting without keeping the node busy."""

    def __init__(
        self, node: Node, kind: type, name: str, begin: Callable[[Any], Any | None]
    ) -> None:
        """Offer the service.

        Args:
            node: the node that offers it.
            kind: service type.
            name: service name.
            begin: takes the request; returns the response, or None to answer later.
        """
        self._begin = begin
        self._waiting: list[Any] = []
        service = node.create_service(kind, name, self._on_request)
        # The executor sends what the callback returns; only here can that be held back.
        self._send = service.send_response
        service.send_response = self._send_or_hold  # type: ignore[method-assign]

    def _on_request(self, request: Any, _response: Any) -> Any:
        response = self._begin(request)
        return _DEFERRED if response is None else response

    def _send_or_hold(self, response: Any, header: Any) -> None:
        if response is _DEFERRED:
            self._waiting.append(header)
        else:
            self._send(response, header)

    def answer(self, response: Any) -> None:
        """Answer all callers that wait."""
        waiting, self._waiting = self._waiting, []
        for header in waiting:
            self._send(response, header)
