"""The subcommands of ``cospeech``: one module for each, or for several that share their options."""
