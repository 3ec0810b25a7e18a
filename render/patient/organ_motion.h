#pragma once
/// Where breath and heartbeat move a patient's organs.

#include <functional>
#include <vector>

#include "render/xray/fluoroscope.h"

namespace render {

/// Gives the layers of soft tissue and air inside the trunk their displacements; bones, skin and head stand
/// still. Organs move as one smooth field, so that what encloses another goes on to do so.
///
/// Breath, in parts of the diaphragm's way: the dome 1, lungs less and less up to their apex, which stands
/// still, kidneys two thirds, pelvis 0. Quiet breathing moves domes by 10 to 17 mm and kidneys by about 10
/// (texts). Heartbeat: heart, lungs and what lies between go where `systole` has them; null = nowhere.
///
/// Where there is breath, the bowel carries each of its bubbles a few millimetres its own way (estimate).
///
/// `origin`: of the body frame (body.h) in that of the layers [mm]; `breath`: of the diaphragm, downward
/// [mm]; `systole`: displacement of a place at the end of systole [mm].
void move_organs(std::vector<TissueLayer>&, const geometry::Vec3& origin, double breath,
                 const std::function<geometry::Vec3(const geometry::Vec3&)>& systole);

/// The part of the diaphragm's way that a height in the body frame [mm] has in breathing [-].
double breathing_fraction(double height);

}  // namespace render
