#pragma once
/// Turns a scenario and its anatomy into the objects that the X-ray chain images.

#include <span>
#include <string>
#include <vector>

#include "engine/exercise/monitor.h"
#include "engine/exercise/simulation.h"
#include "engine/scenario/scenario.h"
#include "render/xray/exposure_meter.h"
#include "render/xray/fluoroscope.h"

namespace exercise {

/// The lumen, closed at its ends, which takes the contrast, surrounded by a patient or air; with the
/// scenario's meshes of the patient. A body from a CT is not among the layers; a synthetic one is kept in the
/// cache. Throws InputError for a lumen that capping does not close, or a mesh that cannot be used.
std::vector<render::TissueLayer> tissue_layers(const scenario::Scenario&, const anatomy::Anatomy&,
                                               const anatomy::ModelCache& = {});

/// Which meshes of the patient were turned from other axes, and why: a sentence each.
std::vector<std::string> patient_notes(const scenario::Scenario&);

/// An organ, or a part of one, that is drawn and that contrast reaches.
struct BlushingOrgan {
    enum class Part { Whole, Outer, Inner };
    int layer = 0;                  // index in the fluoroscope
    double volume = 0;              // [ml]
    std::vector<int> outlets;       // of the blood, those that supply it
    std::vector<double> fractions;  // of each outlet's iodine, what goes here [-]
    Part part = Part::Whole;        // which part of that iodine: Inner is blood::Blush::inner

    double iodine(std::span<const blood::Blush>) const;  // [mg]
};

/// The layers that an outlet supplies: those of its territories of the brain, or the nearest that its organ's
/// name ends with ("kidney", "left kidney").
std::vector<int> supplied_layers(const std::vector<render::TissueLayer>&, const blood::Outlet&);

/// Where the iodine behind each outlet shows: in the layers that it supplies, in proportion to their volumes.
/// A layer with a "cortex" and a "medulla" ("left kidney cortex") shows it in these. Iodine is conserved.
std::vector<BlushingOrgan> blushing_organs(const std::vector<render::TissueLayer>&,
                                           std::span<const blood::Outlet>);

struct ImagingChain {
    render::Fluoroscope fluoroscope;
    std::vector<BlushingOrgan> organs;
};

/// A fluoroscope for the scenario, with the nodes of that contrast. A CT that has been prepared is kept in
/// the cache. Throws InputError when it cannot be made.
ImagingChain make_imaging(const scenario::Scenario&, const anatomy::Anatomy&, const blood::ContrastFlow&,
                          const anatomy::ModelCache& = {});

/// What images from that arm need of the scenario's patient as long as there is no contrast, where the cache
/// has it: frames of Fluoroscope::of_view({}, view) are those of make_imaging's. Never of patients that move,
/// or from files.
std::optional<render::StillView> kept_view(const scenario::Scenario&, const anatomy::Anatomy&,
                                           const render::CArm&, const anatomy::ModelCache&);
/// Keeps it, as the fluoroscope of this patient sees it, unless it is there. Whether the cache has it now.
bool keep_view(const scenario::Scenario&, const anatomy::Anatomy&, const render::CArm&, render::Fluoroscope&,
               const anatomy::ModelCache&);

/// A fluoroscope for the truth of images alone, without the patient: its device_pixels and
/// vessel_pixels are those of the scenario's fluoroscope, with the nodes of that contrast. Throws InputError
/// for a lumen that cannot be closed.
render::Fluoroscope make_masking(const scenario::Scenario&, const anatomy::Anatomy&,
                                 const blood::ContrastFlow&);

/// Dose of a pulse in that mode [nGy]. A field magnified relative to that at the start gets proportionally
/// more, so that larger images are not noisier, up to largest_detector_dose.
double detector_dose(const scenario::Scenario&, const render::CArm&, script::ImagingMode);
/// Makes it a pulse of that mode: its dose and its grey curve.
void set_mode(Pulse&, const scenario::Scenario&, script::ImagingMode);
/// Whether magnification asks for more than that.
bool dose_is_limited(const scenario::Scenario&, const render::CArm&, script::ImagingMode);

/// What automatic exposure knows of the scenario's patient: gives the doses of the fluoroscope's pulses
/// without images. Throws InputError as make_imaging does for a lumen that cannot be closed.
render::ExposureMeter make_meter(const scenario::Scenario&, const anatomy::Anatomy&,
                                 const anatomy::ModelCache& = {});
/// Arm, dose and voltage of the pulse that the console asks for: all that exposure depends on.
render::Exposure metered_exposure(const Simulation&);

/// The pulse that the console asks for, with what is in the beam, after the step of that frame.
Pulse pulse_of(const Simulation&, const FrameTime&, std::span<const BlushingOrgan>);
/// What has leaked through a hole, as it lies in the tissue before vessels move: a pool of the blood beside
/// the vessel in which the iodine is spread, uneven as tissue planes lead it, and densest at the hole. The
/// clouds' iodine adds up to the hole's.
std::vector<render::IodineCloud> clouds_of(const blood::BloodFlow&, const blood::Hole&);
/// Contrast that leaves a tube's end into a vessel, until it has mixed with the blood there: a round
/// turbulent jet (Pope, Turbulent Flows, 2000, §5.1), whose concentration on the axis falls as five bores
/// over the way gone, in a normal distribution of a tenth of that way, until it meets the wall.
std::vector<render::IodineCloud> cloud_of(const anatomy::Anatomy&, const Simulation::Jet&);
/// Where truth has extravasation: as much iodine in the tissue as in a vessel of 1 mm with 3 mg/ml
/// [mg/ml·mm].
inline constexpr double cloud_shows = 3;
bool has_contrast(const render::Exposure&);
void remove_contrast(Pulse&);

}  // namespace exercise
