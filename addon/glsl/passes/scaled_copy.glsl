/* SPDX-License-Identifier: GPL-3.0-or-later
 * A picture times a factor; each of its pixels covers some, so many along its side. */
void main()
{
  radiance = scale.factor * texelFetch(source, ivec2(gl_FragCoord.xy) / scale.stride, 0);
}
