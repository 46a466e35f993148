"""The inspection run: from a rig's pictures to the parts in view and the pose of the cameras."""

from vision.inspection.answer import Inspection
from vision.inspection.inspection import KERNELS, Task, inspect

__all__ = ["KERNELS", "Inspection", "Task", "inspect"]
