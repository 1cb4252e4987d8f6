/* SPDX-License-Identifier: GPL-3.0-or-later
 * What surfaces send out by themselves. */
void main()
{
  ivec2 texel = surface_texel(scale.stride);
  radiance = vec4(0.0);
  float material = texelFetch(surface_position, texel, 0).w;
  if (material > 0.0) {
    Surface s;
    unpack_surface(texel, int(material + 0.5), s);
    radiance = scale.factor * vec4(s.emission, 0.0);
  }
}
