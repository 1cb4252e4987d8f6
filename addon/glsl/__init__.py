# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders, and what builds them.

`lib/` holds functions, `passes/` holds one main() for each pass that only wires them.
`uniforms` declares a block of uniforms once for Python and for GLSL; `shader` builds a
`gpu.types.GPUShader` from a `PassShader` and draws with it. The rooms that own a pass
describe it; nothing here knows what is drawn.
"""
