#pragma once
/// Ground truth of images, as files next to the images.

#include <filesystem>
#include <string>

#include "engine/exercise/truth.h"

namespace run {

/// The text of frame_000123.json: C-arm, camera matrix (rows of P, which maps patient coordinates [mm] to
/// pixels by (u·w, v·w, w) = P·(x, y, z, 1); pixel centres lie at halves), joints in both, the tip, and the
/// masks' file names.
std::string to_json(const exercise::Truth&, const exercise::FrameTime&);

/// Writes frame_000123.json, frame_000123_wire.png and frame_000123_vessels.png. Throws InputError.
void write_truth(const std::filesystem::path& folder, const exercise::Truth&, const exercise::FrameTime&);

}  // namespace run
