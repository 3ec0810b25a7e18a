#pragma once
/// What contrast goes in by besides the devices: the introducer, and a flush catheter from another access.
/// Only the image and the blood know them; devices meet neither.

#include <string>

#include "engine/anatomy/anatomy.h"
#include "engine/blood/blood_flow.h"
#include "physics/geometry/polyline.h"
#include "physics/wire/device.h"
#include "render/xray/wire_image.h"

namespace exercise {

struct StillTube {
    physics::DeviceSpec spec;   // its diameters and length
    geometry::Polyline joints;  // from the hub to the end [mm]
    render::WireLook look;
};

/// The sheath at the end that the devices come in by, as long as the opening says: straight out of the
/// vessel, as physics::PastEnd has it. One in a vessel that no skin is near, such as the aorta, a carotid or
/// a coronary artery, is a guiding catheter, long enough to leave the image; one that would leave an artery
/// across the body turns to the head, as from the mouth of a coronary artery into the ascending aorta.
StillTube introducer_of(const anatomy::Anatomy&);

/// A 5 F flush catheter of 650 mm.
physics::DeviceSpec flush_catheter();
/// One that ends in that cell of a branch. It comes from the widest open end that neither blood nor devices
/// come in by, or beside the devices where there is no other, along the centreline, cut short in bends as a
/// stiff tube lies; in an aorta its end is a pigtail.
StillTube flush_catheter_to(const anatomy::Anatomy&, const blood::FlowCell&);

}  // namespace exercise
