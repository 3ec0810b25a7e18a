#pragma once
/// NAME.anatomy.json and its binary STL in the same folder, as load_anatomy reads them.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace anatomy {

/// How an anatomy was made, as keys and texts.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// Throws InputError unless files can be given this name in a folder.
void check_anatomy_name(const std::string&);

/// The anatomy as load_anatomy would find it after write_anatomy, without files.
Anatomy read_back(const Anatomy&);

/// Writes FOLDER/NAME.stl, then FOLDER/NAME.anatomy.json, and returns the path of the latter. Creates the
/// folder if it does not exist. Throws InputError; neither file is then left half-written.
std::filesystem::path write_anatomy(const Anatomy&, const std::filesystem::path& folder, const Provenance&);

/// A file of 3D Slicer's (.mrk.json) with one list of points [mm, LPS]. `type`: Fiducial or Curve. Points
/// without a label are numbered; radii, where there are as many as points, become a measurement.
std::string markup(const std::string& type, const std::string& name, const geometry::Polyline&,
                   const std::vector<std::string>& labels = {}, const std::vector<double>& radii = {});

/// Writes what 3D Slicer opens: NAME.stl, whose header says SPACE=LPS, ends.mrk.json and targets.mrk.json as
/// points, and centrelines/BRANCH.mrk.json as curves with radii. Returns the files. Throws InputError.
std::vector<std::filesystem::path> write_for_slicer(const Anatomy&, const std::filesystem::path& folder);

}  // namespace anatomy
