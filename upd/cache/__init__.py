"""What is kept on disk: where, under which key, written whole or not at all."""
