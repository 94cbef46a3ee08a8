"""The whole firmware with the app in QEMU: `make emulate`, host/docs/emulate.md."""
