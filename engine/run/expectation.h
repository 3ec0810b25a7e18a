#pragma once
/// An earlier run that this one is compared with.

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

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

}  // namespace run
