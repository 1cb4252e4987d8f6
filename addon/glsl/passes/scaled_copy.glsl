/* SPDX-License-Identifier: GPL-3.0-or-later
 * A picture times a factor. */
void main()
{
  radiance = scale.factor * texelFetch(source, ivec2(gl_FragCoord.xy), 0);
}
