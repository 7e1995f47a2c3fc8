"""The XGV on the wire: its JAUS messages become commands, its state becomes reports."""
