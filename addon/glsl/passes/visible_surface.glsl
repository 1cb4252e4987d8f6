/* SPDX-License-Identifier: GPL-3.0-or-later
 * The surface that each pixel of the view sees: where it is, which way it faces, what it is
 * made of. */
void main()
{
  cut_away();
  vec3 N = normalize(surface_normal);
  /* Toward the eye: its place less the surface's, or the direction of parallel projection. */
  vec3 V = eye.place.xyz - eye.place.w * local_position;
  visible_position = vec4(local_position, float(surface_material + 1));
  visible_normal = vec4(dot(N, V) < 0.0 ? -N : N, 0.0);
#ifdef HAS_OBJECT_ID
  visible_object = float(surface_object + 1);
#endif
}
