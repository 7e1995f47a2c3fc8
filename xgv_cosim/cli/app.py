"""Puts the commands together and turns errors into one clear message and an exit code.

Exit codes: 0 as expected, 1 an expectation failed (or replay differs), 2 bad scenario or usage,
3 system error, 130 interrupted.
"""

from __future__ import annotations

import sys
import traceback

import typer

from xgv_cosim._version import __version__
from xgv_cosim.cli.exit_codes import EXIT_INTERRUPTED, EXIT_OK, EXIT_SYSTEM_ERROR, exit_code_of
from xgv_cosim.errors import XgvCosimError


def _exit_with(code: object, **_options: object) -> None:
    """End with the exit code that a command returns; a command that returns none went well."""
    raise typer.Exit(code if isinstance(code, int) else EXIT_OK)


app = typer.Typer(
    name="xgv-cosim",
    help="Emulated drive-by-wire vehicles in SUMO traffic: e-stop, override and control modes under test.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    result_callback=_exit_with,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"xgv-cosim {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: bool = typer.Option(
        False, "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
    ),
) -> None:
    """Emulated drive-by-wire vehicles in SUMO traffic."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its code; wrong usage exits with 2, an interrupt with 130.

    A fault of xgv-cosim itself exits with 3 after its traceback: 1 would say that an expectation failed.
    """
    try:
        app(args=arguments)
    except XgvCosimError as error:
        typer.echo(f"error: {error}", err=True)
        sys.exit(exit_code_of(error))
    except KeyboardInterrupt:
        sys.exit(EXIT_INTERRUPTED)
    except Exception:  # noqa: BLE001 - told in full, nothing is hidden
        traceback.print_exc()
        typer.echo("this is a fault of xgv-cosim; please report it", err=True)
        sys.exit(EXIT_SYSTEM_ERROR)
