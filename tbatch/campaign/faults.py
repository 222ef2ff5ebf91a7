"""What can stop a campaign. Nothing here is a bug: each says what happened, where, and what to do next."""

from pathlib import Path


class CampaignFault(Exception):
    """A campaign could not start, go on or be read; the folder is as safe as it was."""


class FolderInUse(CampaignFault):
    """Another process is working in the campaign folder."""


class FolderUnusable(CampaignFault):
    """The folder cannot be used as asked: not a campaign folder, not writable, or not found."""


class ScenarioChanged(CampaignFault):
    """The folder holds a campaign of another scenario; names the keys that differ."""


class StoreDamaged(CampaignFault):
    """A file of the store is missing, cut, altered or foreign; no number is taken from such a store."""

    def __init__(self, damage: str | list[str], folder: Path | None = None) -> None:
        """Takes one line for each damaged file, each naming it."""
        self.damage = [damage] if isinstance(damage, str) else list(damage)
        lines = "\n".join(f"  {line}" for line in self.damage)
        advice = "Delete what is damaged and run the campaign again: only the runs that it held are redone."
        super().__init__(f"damaged result store{f' {folder}' if folder else ''}:\n{lines}\n{advice}")


class OutOfSpace(CampaignFault):
    """The disk or the memory is full; what was stored stays, and the campaign can be resumed."""


class ClusterUnusable(CampaignFault):
    """The workers that were to simulate cannot be had; what was stored stays, and the campaign can be resumed."""


class Interrupted(CampaignFault):
    """Somebody asked the campaign to stop; what was stored stays, and the campaign can be resumed."""

    def __init__(self, signal_number: int, message: str = "") -> None:
        """Takes the signal that asked for it."""
        self.signal_number = signal_number
        super().__init__(message or f"interrupted by signal {signal_number}")
