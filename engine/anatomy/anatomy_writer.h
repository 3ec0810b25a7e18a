#pragma once
/// NAME.anatomy.json and its binary STL in the same folder, as load_anatomy reads them.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// What made an anatomy, as keys and texts.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// Throws InputError unless files of this name can be written in a folder.
void check_anatomy_name(const std::string&);
/// Makes the folder where it is not there. Throws InputError unless it can be written.
void check_anatomy_folder(const std::filesystem::path&);

/// Writes FOLDER/NAME.stl, then FOLDER/NAME.anatomy.json, and returns the latter. The folder is made when it
/// is not there. Throws InputError; neither file is then left half-written.
std::filesystem::path write_anatomy(const Anatomy&, const std::filesystem::path& folder, const Provenance&);

}  // namespace anatomy
