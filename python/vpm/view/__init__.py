"""A machine to look at: in the browser, as a page to send, as a film."""

from vpm.view.build import scene_of
from vpm.view.course import Course, course_of
from vpm.view.scene import Arrow, Box, Scene, Shape, Sphere, Tube
from vpm.view.viewing import view

__all__ = ["Arrow", "Box", "Course", "Scene", "Shape", "Sphere", "Tube", "course_of", "scene_of", "view"]
