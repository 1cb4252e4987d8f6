/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the object that a pixel sees has to do with a light (addon/relight/lights/light_objects.py). */

/* How much it gets through diffuse (x) and specular (y) lobes, and whether it stands in its own
 * light (z: 1 or 0). */
vec3 object_share(ivec2 pixel)
{
  int object = int(texelFetch(surface_object, pixel, 0).r + 0.5) - 1;
  int width = textureSize(object_table, 0).x;
  return texelFetch(object_table, ivec2(object % width, object / width), 0).xyz;
}
