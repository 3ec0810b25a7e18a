#include "engine/anatomy/grow/generate_run.h"

#include <array>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/grow/generator.h"
#include "engine/anatomy/grow/vessel_file.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "physics/geometry/hash.h"
#include "physics/geometry/mapped_file.h"
#include "physics/geometry/random.h"
#include "physics/geometry/state.h"

namespace anatomy {
namespace {

namespace fs = std::filesystem;

/// To be raised whenever the same spec gives another mesh or description.
constexpr int generator_version = 4;

VesselTreeSpec make_spec(const GenerateRequest& request) {
    VesselTreeSpec spec = request.source.ends_with(".toml")
                              ? load_vessel_file(request.source, request.seed, request.patient)
                              : vessel_preset(request.source, request.seed, request.patient);
    const auto append = [](auto& to, const auto& more) { to.insert(to.end(), more.begin(), more.end()); };
    append(spec.stenoses, request.stenoses);
    append(spec.aneurysms, request.aneurysms);
    append(spec.tortuosities, request.tortuosities);
    complete_branch_names(spec);
    if (!request.name.empty())
        spec.name = request.name;
    else
        spec.name = name_of_grown(spec.name, request.seed);
    check_anatomy_name(spec.name);
    return spec;
}

/// Adds every number of the tree and its targets, so that another shape of the same name differs.
template <class Add>
void add_shape(const VesselTreeSpec& spec, const VesselTree& tree, const Add& add) {
    for (const SampledBranch& branch : tree.branches) {
        for (const char c : branch.name) add(c);
        add(branch.parent), add(branch.parent_sample), add(branch.closed);
        if (branch.joined >= 0) add(branch.joined), add(branch.joined_sample);
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) add(branch.points[i][axis]);
            add(branch.radii[i]);
        }
    }
    for (const CalciumDeposit& deposit : tree.calcium) {
        for (std::size_t i = 0; i < deposit.points.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) add(deposit.points[i][axis]);
            add(deposit.radii[i]);
        }
    }
    if (spec.body) {
        add(static_cast<double>(spec.body->landmark));
        for (int axis = 0; axis < 3; ++axis) add(spec.body->at[axis]);
    }
    for (const NamedTarget& target : spec.targets) {
        for (const char c : target.name + target.branch) add(c);
        add(target.at);
    }
}

std::string fingerprint(const VesselTreeSpec& spec) {
    std::uint64_t hash = geometry::fnv1a("");
    add_shape(spec, grow(spec),
              [&hash](double number) { hash = geometry::fnv1a(io::number_text(number) + " ", hash); });
    return io::hash_text(hash);
}

Provenance provenance_of(const GenerateRequest& request, const VesselTreeSpec& spec) {
    Provenance made = {{"source", "generated"},
                       {"program", request.program},
                       {"generator", std::to_string(generator_version)},
                       {"spec", fs::path(request.source).filename().string()},
                       {"seed", std::to_string(request.seed)}};
    if (spec.patient) made.emplace_back("patient", spec.patient->text());
    std::vector<std::string> modified;
    for (const Tortuosity& t : spec.tortuosities)
        modified.push_back(fmt::format("tortuosity {}:{}:{}", t.amplitude, t.wavelength,
                                       t.part.empty() ? t.branch : t.part));
    for (const Stenosis& s : spec.stenoses)
        modified.push_back(fmt::format("stenosis {}:{}:{}:{}", s.branch, s.at, s.length, s.percent));
    for (const Aneurysm& a : spec.aneurysms)
        modified.push_back(fmt::format("aneurysm {}:{}:{}:{}", a.branch, a.at, a.diameter, a.neck));
    for (const FusiformAneurysm& a : spec.fusiform)
        modified.push_back(fmt::format("fusiform {}:{}:{}:{}", a.branch, a.at, a.length, a.diameter));
    for (const Occlusion& o : spec.occlusions)
        modified.push_back(fmt::format("occlusion {}:{}", o.branch, o.at));
    for (const Dissection& d : spec.dissections)
        modified.push_back(fmt::format("dissection {}:{}:{}:{}", d.branch, d.at, d.length, d.true_fraction));
    if (!modified.empty()) made.emplace_back("modified", io::joined(modified));
    made.emplace_back("shape", fingerprint(spec));
    made.emplace_back("licence", "project");
    return made;
}

/// The anatomy in the folder, when it is complete and was made from the same input.
std::optional<Anatomy> kept(const fs::path& file, const Provenance& wanted) {
    std::error_code ignored;
    if (!fs::exists(file, ignored)) return std::nullopt;
    const std::string text = io::read_text(file, "anatomy", "expected a NAME.anatomy.json");
    try {
        io::check_json_depth(text, file.string());
    } catch (const io::InputError&) {
        return std::nullopt;
    }
    const nlohmann::json root = nlohmann::json::parse(text, nullptr, false);
    if (root.is_discarded() || !root.is_object() || !root.contains("provenance")) return std::nullopt;
    nlohmann::json made = nlohmann::json::object();
    for (const auto& [key, value] : wanted) made[key] = value;
    if (root["provenance"] != made) return std::nullopt;
    try {
        return load_anatomy(file);
    } catch (const io::InputError&) {
        return std::nullopt;
    }
}

/// Vessels as they are kept, without name and targets: those of one shape are the same under every name.
struct KeptVessels {
    Anatomy& vessels;

    void state(geometry::StateStream& s) {
        std::vector<Eigen::Vector3i> corners;
        for (const auto& t : vessels.lumen.triangles) corners.emplace_back(t[0], t[1], t[2]);
        std::uint64_t branches = vessels.branches.size(), ends = vessels.ends.size(),
                      deposits = vessels.calcium.size();
        bool in_body = vessels.body.has_value();
        s(vessels.lumen.vertices, corners, branches, ends, deposits, in_body);
        if (s.restores()) {
            vessels.lumen.triangles.reserve(corners.size());
            for (const Eigen::Vector3i& c : corners) vessels.lumen.triangles.push_back({c[0], c[1], c[2]});
            vessels.branches.resize(branches);
            vessels.ends.resize(ends);
            vessels.calcium.resize(deposits);
            if (in_body) vessels.body.emplace();
        }
        for (CentrelineBranch& b : vessels.branches) s(b.name, b.parent, b.parent_sample, b.points, b.radii);
        for (VesselEnd& end : vessels.ends)
            s(end.role, end.opening.name, end.opening.centre, end.opening.outward_normal, end.opening.radius);
        for (CalciumDeposit& deposit : vessels.calcium) s(deposit.points, deposit.radii);
        if (in_body) s(vessels.body->landmark, vessels.body->at);
    }
};

/// The place of vessels without their targets, so that another target needs no other ones, and the key of
/// what is in it.
struct Kept {
    std::uint64_t key;
    CachePlace place;

    Kept(VesselTreeSpec spec, const VesselTree& tree, const ModelCache& cache)
        : key(key_of(std::move(spec), tree)), place(cache, "anatomy-" + io::hash_text(key) + ".bin") {}
    std::optional<Anatomy> vessels() const {
        const auto file = place.exists() ? geometry::MappedFile::of(place.path()) : nullptr;
        if (!file) return std::nullopt;
        const std::span<const std::byte> state = unsealed(key, file->bytes());
        if (state.empty()) return std::nullopt;
        Anatomy found;
        KeptVessels kept{found};
        geometry::restore_state(kept, state);
        return found;
    }
    bool keep(Anatomy& vessels) const {
        return place.keep_file(sealed(key, geometry::state_of(KeptVessels{vessels})));
    }

private:
    static std::uint64_t key_of(VesselTreeSpec spec, const VesselTree& tree) {
        constexpr std::uint64_t layout = 3;  // of the file
        geometry::Hash hash;
        hash.add(std::uint64_t{generator_version});
        hash.add(layout);
        spec.targets.clear();
        add_shape(spec, tree, [&hash](double number) { hash.add(number); });
        return hash.value();
    }
};

}  // namespace

GenerateOutcome run_generate(const GenerateRequest& request) {
    const VesselTreeSpec spec = make_spec(request);
    const Provenance provenance = provenance_of(request, spec);
    std::vector<io::Output> outputs;
    for (const char* ending : {".stl", ".anatomy.json"})
        outputs.push_back({"--out", request.out / (spec.name + ending)});
    if (request.source.ends_with(".toml"))
        io::require_distinct(outputs, std::array{std::filesystem::path(request.source)});
    const io::OwnFolder own(request.out, spec.name);
    for (const io::Output& output : outputs) io::require_writable(output.file);
    GenerateOutcome outcome;
    outcome.file = request.out / (spec.name + ".anatomy.json");
    std::optional<Anatomy> anatomy = kept(outcome.file, provenance);
    outcome.kept = anatomy.has_value();
    if (!anatomy) {
        GeneratorOptions options;
        options.threads = request.threads;
        options.progress = request.progress;
        anatomy = generate(spec, options);
        write_anatomy(*anatomy, request.out, provenance);
    }
    if (spec.patient) outcome.patient = spec.patient->text();
    outcome.triangles = anatomy->lumen.triangles.size();
    outcome.branches = anatomy->branches.size();
    for (const VesselEnd& end : anatomy->ends) outcome.ends.push_back(end.opening.name);
    for (const VesselTarget& target : anatomy->targets) outcome.targets.push_back(target.name);
    return outcome;
}

Anatomy generated_anatomy(const VesselTreeSpec& wanted, const ModelCache& cache) {
    const VesselTree tree = grow(wanted);
    const auto as_wanted = [&](Anatomy anatomy) {
        anatomy.name = wanted.name;
        place_targets(anatomy, wanted, tree);
        return anatomy;
    };
    const Kept kept(wanted, tree, cache);
    if (std::optional<Anatomy> vessels = kept.vessels()) {
        kept.place.used();
        return as_wanted(*std::move(vessels));
    }
    GeneratorOptions options;
    options.progress = cache.progress;
    count(Made::Vessels);
    // With the bits that files of anatomies hold.
    Anatomy grown = read_back(generate(wanted, options));
    kept.keep(grown);
    return as_wanted(std::move(grown));
}

bool is_kept(const VesselTreeSpec& wanted, const ModelCache& cache) {
    return Kept(wanted, grow(wanted), cache).vessels().has_value();
}

}  // namespace anatomy
