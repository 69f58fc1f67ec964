"""The container that usdview finds by plugInfo.json: commands, and a menu for them."""

from pxr import Tf
from pxr.Usdviewq.plugin import PluginContainer

__all__ = ["UsdfaceContainer"]


class UsdfaceContainer(PluginContainer):
    """The commands of usdface in usdview; the dock is imported when one is called."""

    def registerPlugins(self, plugRegistry, usdviewApi):
        """Register the commands."""
        commands = self.deferredImport("usdface_usdview.commands")
        self._items = [
            plugRegistry.registerCommandPlugin(
                f"UsdfaceContainer.{name}", title, getattr(commands, name), description
            )
            for name, title, description in (
                ("show_panel", "Panel", "The dock of usdface"),
                (
                    "process",
                    "Process this shot",
                    "Retarget the shot that is open, in the background",
                ),
                ("toggle_expressions", "Expressions on/off", "Mute or unmute the expression layer"),
                ("save", "Save result ...", "Write the result as files beside the shot"),
            )
        ]

    def configureView(self, plugRegistry, plugUIBuilder):
        """Put the commands into a menu."""
        menu = plugUIBuilder.findOrCreateMenu("usdface")
        for item in self._items:
            menu.addItem(item)


Tf.Type.Define(UsdfaceContainer)
