# SPDX-License-Identifier: GPL-3.0-or-later
"""A small scene with something of everything that a bake could leave changed behind."""

from __future__ import annotations

from typing import Any

import bpy

from .material_grid import add_plane, empty_material, empty_scene, node_in
from .test_materials import fresnel_mix, glass, mixed, nested_groups, principled


def full_scene() -> Any:
    """Settings unlike the bake's own, users of materials of many kinds, two scenes and layers,
    animation, modifiers, images, custom properties, what is hidden and what is selected."""
    scene = empty_scene()
    for x, maker in enumerate((principled, mixed, nested_groups, fresnel_mix, glass)):
        add_plane(scene, maker.__name__, (x - 2.0, 0.0, 0.0), maker())
    _add_users(scene)
    _add_textured(scene)
    _add_animation(scene)
    _add_deformed(scene)
    _add_layers(scene)
    _set_up(scene)
    scene.view_layers[0].update()
    return scene


def _add_users(scene: Any) -> None:
    """Users of materials of every kind."""
    materials = bpy.data.materials
    materials["mixed"].use_fake_user = True
    instance = bpy.data.objects.new("same mesh", bpy.data.objects["mixed"].data)
    scene.collection.objects.link(instance)
    instance.location = (0.0, 2.0, 0.0)
    instance.material_slots[0].link = "OBJECT"
    instance.material_slots[0].material = materials["principled"]
    add_plane(scene, "bare", (2.0, 2.0, 0.0), None)
    slots = add_plane(scene, "slots", (-2.0, 2.0, 0.0), materials["mixed"])
    slots.data.materials.append(None)
    slots.data.materials.append(materials["principled"])
    slots.active_material_index = 2
    cut, surface = empty_material("cut out")
    checks = cut.node_tree.nodes.new("ShaderNodeTexChecker")
    bsdf = node_in(cut.node_tree, "ShaderNodeBsdfPrincipled", Alpha=checks.outputs["Fac"])
    cut.node_tree.links.new(bsdf.outputs[0], surface)
    add_plane(scene, "cut out", (3.0, 1.0, 0.0), cut)
    # Not shown by anything.
    empty_material("spare")
    pointing = bpy.data.objects.new("pointing", None)
    scene.collection.objects.link(pointing)
    pointing["its material"] = materials["window"]
    pointing["more"] = {"numbers": [1.0, 2.5], "inner": {"word": "text"}}


def _add_textured(scene: Any) -> None:
    """Images that are generated, packed and missing; a ramp and curves in a nested group."""
    material, surface = empty_material("textured")
    material["of its own"] = 3
    tree = material.node_tree
    colour = None
    for name in ("generated", "packed", "missing"):
        image = bpy.data.images.new(name, 4, 4, float_buffer=name == "generated")
        image.pixels[:] = [0.1 * (i % 7) for i in range(64)]
        if name == "packed":
            image.pack()
        if name == "missing":
            image.source, image.filepath = "FILE", "//nowhere/missing.png"
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        mix = node_in(tree, "ShaderNodeMix")
        mix.data_type = "RGBA"
        if colour is not None:
            tree.links.new(colour, mix.inputs[6])
        tree.links.new(texture.outputs["Color"], mix.inputs[7])
        colour = mix.outputs[2]
    group = bpy.data.node_groups.new("graded", "ShaderNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Color", in_out=way, socket_type="NodeSocketColor")
    ramp = node_in(group, "ShaderNodeValToRGB")
    ramp.color_ramp.elements.new(0.4).color = (1.0, 0.5, 0.2, 1.0)
    curves = node_in(group, "ShaderNodeRGBCurve")
    curves.mapping.curves[3].points.new(0.3, 0.6)
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(start.outputs[0], ramp.inputs[0])
    group.links.new(ramp.outputs[0], curves.inputs["Color"])
    group.links.new(curves.outputs[0], end.inputs[0])
    graded = tree.nodes.new("ShaderNodeGroup")
    graded.node_tree = group
    tree.links.new(colour, graded.inputs[0])
    bsdf = node_in(tree, "ShaderNodeBsdfPrincipled", Base_Color=graded.outputs[0])
    tree.links.new(bsdf.outputs[0], surface)
    add_plane(scene, "textured", (0.0, -2.0, 0.0), material)


def _add_animation(scene: Any) -> None:
    """Keys and drivers of objects, of nodes and of the scene."""
    mover = bpy.data.objects["textured"]
    mover.keyframe_insert("location", frame=1)
    mover.location.z = 0.1
    mover.keyframe_insert("location", frame=20)
    node = bpy.data.materials["principled"].node_tree.nodes["Principled BSDF"]
    node.inputs["Coat Roughness"].keyframe_insert("default_value", frame=1)
    driver = bpy.data.objects["mixed"].driver_add("rotation_euler", 2).driver
    driver.expression = "frame * 0.01 + size"
    variable = driver.variables.new()
    variable.name = "size"
    variable.targets[0].id = mover
    variable.targets[0].data_path = "location.z"
    scene.timeline_markers.new("cut", frame=7)
    track = mover.animation_data.nla_tracks.new()
    track.strips.new("strip", 40, mover.animation_data.action)


def _add_deformed(scene: Any) -> None:
    """Modifiers, one of which is only rendered; shape keys; an armature; particles; a text."""
    deformed = add_plane(scene, "deformed", (2.0, -2.0, 0.0), bpy.data.materials["principled"])
    smooth = deformed.modifiers.new("smooth", "SUBSURF")
    smooth.levels, smooth.render_levels, smooth.show_viewport = 1, 2, False
    deformed.shape_key_add(name="Basis")
    deformed.shape_key_add(name="raised", from_mix=False).data[0].co.z = 0.2
    deformed.data.shape_keys.key_blocks["raised"].value = 0.5
    group = deformed.vertex_groups.new(name="weights")
    group.add([0, 2], 0.7, "REPLACE")
    bones = bpy.data.objects.new("bones", bpy.data.armatures.new("bones"))
    scene.collection.objects.link(bones)
    emitter = add_plane(scene, "emitter", (-2.0, -2.0, 0.0), None)
    emitter.modifiers.new("particles", "PARTICLE_SYSTEM")
    emitter.particle_systems[0].settings.count = 3
    bpy.data.texts.new("notes").write("a line")
    curve = bpy.data.curves.new("words", "FONT")
    curve.body = "A"
    words = bpy.data.objects.new("words", curve)
    words.location = (0.0, -3.5, 0.0)
    scene.collection.objects.link(words)
    curve.materials.append(bpy.data.materials["principled"])


def _add_layers(scene: Any) -> None:
    """Collections, one excluded and one instanced; layers; what is hidden and selected."""
    inner = bpy.data.collections.new("inner")
    scene.collection.children.link(inner)
    add_plane(scene, "inside", (1.0, 3.0, 0.0), bpy.data.materials["mixed"])
    inside = bpy.data.objects["inside"]
    scene.collection.objects.unlink(inside)
    inner.objects.link(inside)
    instancer = bpy.data.objects.new("instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", inner
    instancer.location = (0.0, 1.0, 0.0)
    scene.collection.objects.link(instancer)
    excluded = bpy.data.collections.new("excluded")
    scene.collection.children.link(excluded)
    add_plane(scene, "unseen", (0.0, 0.0, -1.0), bpy.data.materials["spare"])
    excluded.objects.link(bpy.data.objects["unseen"])
    layer = scene.view_layers[0]
    second = scene.view_layers.new("second")
    second.layer_collection.children["excluded"].exclude = True
    second.layer_collection.children["inner"].holdout = True
    layer.aovs.add().name = "mine"
    layer.pass_alpha_threshold = 0.25
    layer.use_pass_mist = True
    layer["a layer's"] = 1.5
    bpy.data.objects["bare"].select_set(True, view_layer=layer)
    bpy.data.objects["mixed"].select_set(True, view_layer=second)
    bpy.data.objects["slots"].hide_set(True, view_layer=layer)
    bpy.data.objects["fresnel_mix"].hide_viewport = True
    bpy.data.objects["unseen"].hide_render = True
    layer.objects.active = bpy.data.objects["mixed"]


def _set_up(scene: Any) -> None:
    """Settings unlike the bake's; a world that varies; another scene with the same objects."""
    light = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "AREA"))
    scene.collection.objects.link(light)
    camera = bpy.data.objects.new("Shot", bpy.data.cameras.new("Shot"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("Sky")
    tree = scene.world.node_tree
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    gradient = node_in(tree, "ShaderNodeTexGradient")
    tree.links.new(gradient.outputs["Color"], background.inputs["Color"])
    scene.render.engine = "BLENDER_EEVEE"
    scene.render.filepath = "//frames/shot_"
    scene.render.resolution_percentage = 37
    scene.render.use_border = True
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "JPEG"
    scene.cycles.samples = 77
    scene.cycles.pixel_filter_type = "GAUSSIAN"
    scene["of the scene"] = [1, 2, 3]
    scene.frame_set(12, subframe=0.25)
    other = bpy.data.scenes.new("other")
    other.collection.objects.link(bpy.data.objects["mixed"])
    other.world = scene.world
