#pragma once
/// A whole run without a display: takes a script; writes frames, score and recording, and compares the run
/// with an earlier one.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "engine/dicom/angiogram.h"
#include "engine/exercise/exercise.h"
#include "engine/run/picture_file.h"
#include "engine/scenario/scenario.h"
#include "engine/script/command.h"
#include "render/picture/image.h"

namespace run {

/// Collects the places where a run differs from the expected state hashes and frames.
class Expectation {
public:
    /// Adds the state lines of a script or recording.
    void add_states(const script::CommandScript&);
    /// Adds a recording, or the output folder of an earlier run: its run.gw and its frames, each of which is
    /// read once to see that it can be. Throws InputError.
    void add(const std::filesystem::path&);

    bool knows_state(int frame) const { return states_.contains(frame); }
    void check_state(int frame, std::uint64_t hash);
    void check_frame(int frame, const render::GrayImage&);
    /// To be called after the last frame: adds states and frames that were expected but never came. `images`:
    /// whether the run made any.
    void finish(int last_frame, bool interrupted, bool images);

    int last_state() const { return states_.empty() ? -1 : states_.rbegin()->first; }
    int compared_states() const { return compared_states_; }
    int compared_frames() const { return compared_frames_; }
    /// The first few differences, a sentence each, and the number of others.
    std::vector<std::string> differences() const;
    /// What was not compared, and why; a sentence each.
    const std::vector<std::string>& notes() const { return notes_; }
    /// What the recording says of the run that is expected.
    const std::optional<script::Origin>& origin() const { return origin_; }
    const std::string& file() const { return file_; }

private:
    void differ(const std::string&);
    std::multimap<int, script::StateCheck> states_;
    std::map<int, std::filesystem::path> frames_;
    std::set<int> seen_;         // frames that were compared
    bool had_images_ = false;    // the run in the folder
    std::vector<int> absent_;    // frames that were made, and of which there is no image to compare with
    std::string folder_, file_;  // what is expected: the folder of the run, and its recording
    std::optional<script::Origin> origin_;
    std::vector<std::string> notes_;
    std::vector<std::string> differences_;
    std::size_t differing_ = 0;
    int compared_states_ = 0, compared_frames_ = 0;
};

struct Progress {
    int frame = 0, frames = 0;  // made so far, in all
    double inserted = 0;        // [mm]
    double tip_to_target = 0;   // [mm]
};

struct RunOptions {
    int every = 1;                                // frames between two images; the last frame always has one
    bool images = true;                           // off = neither frames nor a sheet
    bool dose = true;                             // in the score, of a run without images too
    bool panel = false;                           // the image with the readouts around it, in panel/
    bool truth = false;                           // ground truth of each image, in truth/
    exercise::TruthParts truth_parts;             // what that has besides masks
    std::optional<dicom::Pixels> dicom;           // the images as DICOM objects, in dicom/
    dicom::Identity dicom_identity;               // of those
    bool slicer = false;                          // devices and poses as markups of 3D Slicer, in slicer/
    std::filesystem::path trace;                  // file for the rows of exercise::Trace (.csv); empty = none
    int hash_every = 10;                          // frames between two state lines of the recording
    script::Origin origin;                        // program and learner, named in the recording
    bool same_origin = false;                     // refuse a recording of another scenario or anatomy
    std::optional<std::filesystem::path> expect;  // recording or output folder to compare with
    std::vector<std::filesystem::path> also_read;  // files that no output may replace
    anatomy::ModelCache cache;  // an empty folder stands for cache beside the output folder
    std::function<void(const Progress&)> progress;  // after each frame
    std::function<bool()> interrupted;              // asked after each frame; true ends the run
    /// Sees each frame; may ask for its image where there are images.
    std::function<void(const exercise::Frame&, exercise::Exercise&)> observer;
    bool images_for_observer = false;  // of a run without files
};

struct RunResult {
    exercise::Score score;                 // of the last attempt
    std::vector<exercise::Score> earlier;  // attempts that a reset ended
    scenario::Benchmark benchmark;
    std::uint64_t state_hash = 0;
    int frames = 0;
    bool interrupted = false;
    bool time_is_up = false;  // the scenario's time limit ended the run
    int compared_states = 0, compared_frames = 0;
    std::vector<std::string> differences;  // from what was expected
    std::vector<std::string> notices;      // what the trainee should know: stops of the wire
};

/// Throws InputError listing all errors of the scenario and of the script in it.
void check(const scenario::Scenario&, const script::CommandScript&);

/// How a recording's origin differs from what it is played in, a sentence each; empty for other scripts.
/// The program may be another: the states show whether it does the same.
std::vector<std::string> other_origin(const std::optional<script::Origin>&, const exercise::Simulation&);

/// Runs the script and leaves run.gw, score.json and, with images, frames/ and sheet.png in `out`. Files left
/// there by an earlier run are replaced. Throws InputError, before anything is written where the error can be
/// detected in time.
RunResult run_headless(const scenario::Scenario&, const script::CommandScript&,
                       const std::filesystem::path& out, const RunOptions&);

/// The same without files.
RunResult run_headless(const scenario::Scenario&, const script::CommandScript&, const RunOptions& = {});

}  // namespace run
