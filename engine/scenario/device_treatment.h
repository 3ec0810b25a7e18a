#pragma once
/// What a device file says of its balloon and its stent.

#include <string>
#include <vector>

#include "engine/io/toml_section.h"
#include "engine/scenario/device.h"

namespace scenario {

/// Reads [balloon] and [stent] as far as the device's kind has them, and refuses them where it has not. Adds
/// what is given to the keys that need a source: "balloon.length_mm", ….
void read_treatment(io::Section& top, Device&, std::vector<std::string>& given);

}  // namespace scenario
