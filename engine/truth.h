#pragma once
/// Ground truth of an image, for those who train or test trackers: where the wire, its tip and the vessels
/// are.

#include <filesystem>
#include <string>

#include "engine/monitor.h"

namespace engine {

struct Truth {
    Pulse pulse;                // that the image shows
    render::GrayImage wire;     // 255 where the wire casts its shadow, else 0
    render::GrayImage vessels;  // 255 where a lumen lies in the beam, else 0
};

Truth truth_of(const Pulse&, render::Fluoroscope&);

/// The text of frame_000123.json: C-arm, camera matrix (rows of P, by which (u·w, v·w, w) = P·(x, y, z, 1)
/// from patient coordinates [mm] to pixels, whose centres lie at halves), joints in both, the tip, and the
/// masks' file names.
std::string to_json(const Truth&, int frame, double frame_rate);

/// Writes frame_000123.json, frame_000123_wire.png and frame_000123_vessels.png. Throws InputError.
void write_truth(const std::filesystem::path& folder, const Truth&, int frame, double frame_rate);

}  // namespace engine
