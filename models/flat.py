"""A robot's file without what it refers to: a flat MJCF of the compiled body, and a hash of all it was made of."""

from __future__ import annotations

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import mujoco

from models.errors import InputError


def fingerprint(path: Path) -> str:
    """SHA-256 of a robot: its MJCF file, the files that this includes, and its meshes, textures and height fields.

    Raises:
        InputError: if one of them cannot be read.
    """
    digest = hashlib.sha256()
    beside = {Path(name) for name in mujoco.mju_getXMLDependencies(str(path))} - {path}
    # What a file is called stands in the file that names it.
    for each in (path, *sorted(beside)):
        try:
            content = each.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: {each} cannot be read: {error.strerror}") from None
        digest.update(len(content).to_bytes(8) + content)
    return digest.hexdigest()


def flat_mjcf(model: mujoco.MjModel) -> str:
    """The bodies, joints, inertias and sites of a compiled model, every number as MuJoCo has it.

    Other libraries read this alike, whatever the file does by includes, defaults, frames, Euler angles or meshes.

    Args:
        model: whose joints are hinges with the reference 0, but for one free joint.
    """
    root = ET.Element("mujoco", model="flat")
    ET.SubElement(root, "compiler", angle="radian")
    elements = {0: ET.SubElement(root, "worldbody")}
    for i in range(1, model.nbody):
        name, first = model.body(i).name, int(model.body_jntadr[i])
        *others, last = range(first, first + int(model.body_jntnum[i])) or [-1]
        # pinocchio takes one joint a body: the others get bodies without mass above it.
        names = [*(f"{name} before {model.joint(joint).name}" for joint in others), name]
        body = ET.SubElement(elements[int(model.body_parentid[i])], "body", name=names[0])
        body.attrib |= {"pos": _text(model.body_pos[i]), "quat": _text(model.body_quat[i])}
        for joint, below in zip(others, names[1:], strict=True):
            _add_joint(body, model, joint)
            body = ET.SubElement(body, "body", name=below)
        elements[i] = body
        inertial = ET.SubElement(body, "inertial", pos=_text(model.body_ipos[i]), quat=_text(model.body_iquat[i]))
        inertial.attrib |= {"mass": _text([model.body_mass[i]]), "diaginertia": _text(model.body_inertia[i])}
        if last >= 0:
            _add_joint(body, model, last)
    for i in range(model.nsite):
        site = {"name": model.site(i).name, "pos": _text(model.site_pos[i]), "quat": _text(model.site_quat[i])}
        ET.SubElement(elements[int(model.site_bodyid[i])], "site", site)
    return ET.tostring(root, encoding="unicode")


def _add_joint(body: ET.Element, model: mujoco.MjModel, i: int) -> None:
    name = model.joint(i).name
    if model.jnt_type[i] == mujoco.mjtJoint.mjJNT_FREE:
        ET.SubElement(body, "freejoint", name=name)
        return
    at = int(model.jnt_dofadr[i])
    joint = {"name": name, "type": "hinge", "pos": _text(model.jnt_pos[i]), "axis": _text(model.jnt_axis[i])}
    joint |= {"limited": "true", "range": _text(model.jnt_range[i])}
    for key, values in (
        ("armature", model.dof_armature),
        ("damping", model.dof_damping),
        ("frictionloss", model.dof_frictionloss),
    ):
        joint[key] = _text([values[at]])
    ET.SubElement(body, "joint", joint)


def _text(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
