"""What a permitted status command does to a component, in words: the oracle beside the table."""

from __future__ import annotations

from jaus.component import ComponentStatus, StatusCommand


def status_in_words(status: ComponentStatus, command: StatusCommand) -> ComponentStatus:
    """XGV-21, XGV-25 and RA 3.3, written apart from the table: what a permitted command makes of a status."""
    if command is StatusCommand.RESUME:
        return ComponentStatus.READY if status is ComponentStatus.STANDBY else status
    if command is StatusCommand.STANDBY:
        return ComponentStatus.STANDBY if status is ComponentStatus.READY else status
    return {
        StatusCommand.SHUTDOWN: ComponentStatus.SHUTDOWN,
        StatusCommand.RESET: ComponentStatus.INITIALIZE,
        StatusCommand.SET_EMERGENCY: ComponentStatus.EMERGENCY,
        StatusCommand.CLEAR_EMERGENCY: ComponentStatus.STANDBY,
    }[command]
