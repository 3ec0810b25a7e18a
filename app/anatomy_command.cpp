/// `seldinger anatomy …`: vessels from presets, files and meshes.

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/progress_bar.h"
#include "engine/anatomy/anatomy_picture.h"
#include "engine/anatomy/anatomy_writer.h"
#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_file.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/import/import_run.h"
#include "engine/exercise/imaging.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/patient/voxelise.h"

namespace app {
namespace {

constexpr double mm_per_cm = 10;

class AnatomyCommand {
public:
    /// Adds the sub-command; must live as long as it does.
    explicit AnatomyCommand(CLI::App&);
    CLI::App* parser() { return command_; }
    /// Returns the exit code: 0, or 2 when a check failed. Throws io::InputError.
    int run();

private:
    void add_generate();
    void add_import();
    void add_check();
    void add_export();
    void add_show();
    void add_voxelise();
    int generate();
    int import();
    int check() const;
    int export_files() const;
    int show() const;
    int voxelise() const;

    CLI::App *command_, *generate_ = nullptr, *import_ = nullptr, *check_ = nullptr, *show_ = nullptr,
                        *voxelise_ = nullptr, *export_ = nullptr;
    anatomy::GenerateRequest request_;
    std::vector<std::string> stenoses_, aneurysms_, tortuosities_;
    std::string sex_;
    std::optional<double> height_cm_;
    anatomy::ImportRequest import_request_;
    std::vector<double> inlet_, opened_, landmark_;
    std::vector<std::string> names_, vessels_;
    std::vector<double> seed_;
    std::string checked_, shown_, exported_, slicer_, picture_, ct_, cache_;
    ScenarioChoice scenario_;
    double voxel_ = 1, margin_ = 100;  // [mm]
};

AnatomyCommand::AnatomyCommand(CLI::App& app)
    : command_(app.add_subcommand("anatomy",
                                  "Make a vessel anatomy that scenarios can name\n\n"
                                  "Examples:\n"
                                  "  seldinger anatomy generate iliac-renal --seed 7 --out vessels\n"
                                  "  seldinger anatomy import lumen.stl --body pelvis --out vessels")) {
    command_->require_subcommand(1);
    add_generate();
    add_import();
    add_check();
    add_export();
    add_show();
    add_voxelise();
}

int AnatomyCommand::run() {
    if (generate_->parsed()) return generate();
    if (import_->parsed()) return import();
    if (voxelise_->parsed()) return voxelise();
    if (export_->parsed()) return export_files();
    return check_->parsed() ? check() : show();
}

void AnatomyCommand::add_generate() {
    CLI::App* generate = generate_ = command_->add_subcommand(
        "generate",
        "Grow vessels from a preset or a file, with a lumen to push wires in\n\n"
        "Examples:\n"
        "  seldinger anatomy generate iliac-renal --seed 7 --out vessels\n"
        "  seldinger anatomy generate aorta --age 78 --sex m --stenosis LCIA:20:15:60 --out vessels");
    generate->add_option("source", request_.source, "A preset, or a vessel tree (.toml)")
        ->required()
        ->type_name("PRESET");
    generate->add_option("--seed", request_.seed,
                         "Draws patient, dimensions and bends of a preset; 0 = the published means");
    generate->add_option("--sex", sex_, "The patient's; else by seed")->check(one_of({"f", "m"}));
    generate->add_option("--age", request_.patient.age, "In years; else by seed")
        ->check(number(anatomy::youngest, anatomy::oldest));
    generate->add_option("--height", height_cm_, "In cm; else by seed")
        ->check(number(anatomy::shortest / mm_per_cm, anatomy::tallest / mm_per_cm));
    generate->add_option("--weight", request_.patient.weight, "In kg; else by seed")
        ->check(number(anatomy::lightest, anatomy::heaviest));
    generate->add_option("--out", request_.out, "Folder for NAME.anatomy.json and NAME.stl")
        ->required()
        ->type_name("FOLDER");
    generate->add_option("--name", request_.name, "NAME; else the preset or the file, with the seed")
        ->type_name("NAME");
    generate
        ->add_option("--stenosis", stenoses_, "BRANCH:AT:LENGTH:PERCENT of the diameter [mm]; again for more")
        ->type_name("STENOSIS");
    generate
        ->add_option("--aneurysm", aneurysms_, "BRANCH:AT:DIAMETER:NECK[:ANGLE] [mm, deg]; again for more")
        ->type_name("ANEURYSM");
    generate->add_option("--tortuosity", tortuosities_, "AMPLITUDE:WAVELENGTH[:BRANCH] [mm]; again for more")
        ->type_name("BENDS");
    generate->add_option("--threads", request_.threads, "Threads; the anatomy does not depend on them")
        ->check(whole_number(1, 256));
    std::string presets = "Presets:\n";
    for (const anatomy::VesselPreset& preset : anatomy::vessel_presets())
        presets += fmt::format("  {:<12} {}\n", preset.name, preset.what);
    generate->footer(presets +
                     "An anatomy that the folder holds already is not made again.\n"
                     "Exit codes: 0 done, 2 bad input.");
}

int AnatomyCommand::generate() {
    for (const std::string& text : stenoses_) request_.stenoses.push_back(anatomy::parse_stenosis(text));
    for (const std::string& text : aneurysms_) request_.aneurysms.push_back(anatomy::parse_aneurysm(text));
    for (const std::string& text : tortuosities_)
        request_.tortuosities.push_back(anatomy::parse_tortuosity(text));
    if (!sex_.empty()) request_.patient.sex = anatomy::parse_sex(sex_);
    if (height_cm_) request_.patient.height = *height_cm_ * mm_per_cm;
    request_.program = program;
    anatomy::GenerateOutcome outcome;
    {
        ProgressBar bar;
        request_.progress = [&bar](double part, const char* what) { bar.show(part, what); };
        outcome = anatomy::run_generate(request_);
    }
    print("{}: {} branches, {} triangles{}\n", outcome.file.string(), outcome.branches, outcome.triangles,
          outcome.kept ? ", kept as it was" : "");
    if (!outcome.patient.empty()) print("patient: {}\n", outcome.patient);
    print("ends:    {}\ntargets: {}\n", io::joined(outcome.ends), io::joined(outcome.targets));
    return 0;
}

void AnatomyCommand::add_import() {
    anatomy::ImportRequest& request = import_request_;
    import_ = command_->add_subcommand(
        "import",
        "Make vessels of the mesh of a lumen, a mask or the contrast of a CT\n\n"
        "Examples:\n"
        "  seldinger anatomy import lumen.stl --unit mm --body pelvis --out vessels\n"
        "  seldinger anatomy import aorta.nii.gz --ct ct.nii.gz --out vessels\n"
        "  seldinger anatomy import lumen.vtp --unit cm --axes ras --out vessels "
        "--scenario mine.toml");
    import_
        ->add_option("vessel", vessels_,
                     "The lumen's surface: STL, OBJ, PLY, OFF, glTF (.glb, .gltf) or VTK PolyData (.vtp, "
                     ".vtk); or a mask, or "
                     "several that are joined: NIfTI (.nii, .nii.gz), NRRD (.nrrd, .seg.nrrd), MetaImage "
                     "(.mha), DICOM SEG (.dcm)")
        ->type_name("FILE");
    import_
        ->add_option("--label", request.mask.labels,
                     "Of a mask with several: the number or name of a label or segment; again for more")
        ->type_name("LABEL");
    import_
        ->add_option("--ct", request.mask.ct,
                     "The CT that the vessel lies in: the patient of the scenario, which is then written to "
                     "NAME.toml beside the anatomy")
        ->type_name("FILE");
    import_->add_flag(
        "--any-frame", request.mask.any_frame,
        "Take a DICOM SEG of another frame of reference than --ct as it is, without registration");
    import_->add_option("--series", request.mask.series, "Of a --ct that is a folder of DICOM files")
        ->type_name("SERIES");
    import_
        ->add_option(
            "--from-ct", seed_,
            "X,Y,Z in mm in the contrast of --ct: the vessel is what hangs together with it, which is "
            "approximate")
        ->delimiter(',')
        ->expected(3)
        ->check(number())
        ->type_name("X,Y,Z");
    import_
        ->add_option("--threshold", request.mask.threshold,
                     "Least of that contrast in HU; else half way between the seed and soft tissue")
        ->check(number(-1000, 3000));
    import_->add_option("--unit", request.options.unit, "Of the mesh's numbers")
        ->check(one_of({"mm", "cm", "m"}));
    import_->add_option("--scale", request.options.frame.scale, "Factor after the unit");
    import_
        ->add_option(
            "--axes", request.options.frame.axes,
            "Of files that do not state theirs: lps (+x left, +y back, as everywhere here), or ras, as some "
            "programs write; else lps. A file that states others is refused")
        ->check(one_of({"lps", "ras"}));
    import_
        ->add_option("--rotate", request.options.frame.rotations,
                     "AXIS:DEG, such as x:90, about the origin and after --axes; again for more, in order")
        ->type_name("AXIS:DEG");
    import_
        ->add_option(
            "--inlet", inlet_,
            "X,Y,Z in mm, after scale, axes and turns, near the end that wires come in by; else the largest")
        ->delimiter(',')
        ->expected(3)
        ->check(number())
        ->type_name("X,Y,Z");
    import_
        ->add_option("--end", opened_,
                     "X,Y,Z in mm near a closed tip that is cut open; again for more. Else all are, where "
                     "fewer than two ends are open")
        ->delimiter(',')
        ->expected(3)
        ->take_all()
        ->check(number())
        ->type_name("X,Y,Z");
    import_
        ->add_option(
            "--centrelines", request.options.centrelines,
            "Take these, with their names: VTK PolyData (.vtp, .vtk, as of VMTK), SimVascular's .pth, JSON "
            "{\"name\": [[x, y, z, r], …]} and VMTK's .dat, all in the mesh's unit, curves of 3D Slicer "
            "(.mrk.json) or "
            "CSV branch,x_mm,y_mm,z_mm[,r_mm]; again for more files")
        ->type_name("FILE");
    import_
        ->add_option(
            "--places", request.options.places,
            "Points of 3D Slicer (.mrk.json): one at an end names it as --name does, another is a target "
            "by its label; again for more files")
        ->type_name("FILE");
    import_
        ->add_option(
            "--view", request.view,
            "C-arm of the scenario, as points of 3D Slicer (.mrk.json) in this order: focal spot, isocentre "
            "(may be left out), middle of the detector")
        ->type_name("FILE");
    import_->add_option("--out", request.out, "Folder for NAME.anatomy.json and NAME.stl")
        ->required()
        ->type_name("FOLDER");
    import_
        ->add_option(
            "--name", names_,
            "NAME of the files, else the mesh's; or END=X,Y,Z in mm: the end there, its branch and its "
            "target are called END (a branch without the .in or .out of END); again for more")
        ->type_name("NAME");
    import_->add_option("--body", request.body, "Where this is")
        ->check(one_of({"pelvis", "abdomen", "chest", "head"}));
    import_
        ->add_option(
            "--landmark", landmark_,
            "X,Y,Z in mm of the aortic bifurcation (pelvis, abdomen), the aortic valve (chest) or the "
            "sella (head); else a guess, which is printed")
        ->delimiter(',')
        ->expected(3)
        ->check(number())
        ->type_name("X,Y,Z");
    import_
        ->add_option("--scenario", request.scenario,
                     "File for the scenario that is printed at the end (.toml)")
        ->type_name("FILE");
    import_->add_option("--threads", request.options.threads, "Threads; the anatomy does not depend on them")
        ->check(whole_number(1, 256));
    import_->footer("Exit codes: 0 done, 2 bad input; nothing is then written.");
}

int AnatomyCommand::import() {
    anatomy::ImportRequest& request = import_request_;
    if (vessels_.empty() == seed_.empty())
        throw BadArgument("expected the FILE of a mesh or a mask, or --from-ct X,Y,Z with --ct, found {}",
                          vessels_.empty() ? "none" : "both");
    if (!seed_.empty()) {
        request.mask.seed = {seed_[0], seed_[1], seed_[2]};
        if (request.mask.ct.empty()) throw BadArgument("--from-ct: expected --ct beside it, found none");
    }
    const auto masks =
        std::ranges::count_if(vessels_, [](const std::string& file) { return anatomy::is_mask_file(file); });
    if (masks == std::ssize(vessels_))
        request.mask.masks.assign(vessels_.begin(), vessels_.end());
    else if (vessels_.size() == 1)
        request.mesh = vessels_[0];
    else
        throw BadArgument("expected one mesh, or masks alone, found {} files", vessels_.size());
    if (!request.mask.labels.empty() && masks == 0) throw BadArgument("--label: expected a mask, found none");
    if (!inlet_.empty()) request.options.inlet = {inlet_[0], inlet_[1], inlet_[2]};
    for (std::size_t i = 0; i + 2 < opened_.size(); i += 3)
        request.options.ends.emplace_back(opened_[i], opened_[i + 1], opened_[i + 2]);
    if (!landmark_.empty()) request.landmark = {landmark_[0], landmark_[1], landmark_[2]};
    for (const std::string& name : names_) {
        if (name.find('=') != std::string::npos) {
            request.options.names.push_back(anatomy::parse_named_place(name));
        } else if (request.name.empty()) {
            request.name = name;
        } else {
            throw BadArgument(
                "--name: expected one for the files, and END=X,Y,Z for each end, found '{}' and '{}'",
                request.name, name);
        }
    }
    request.program = program;
    anatomy::ImportOutcome outcome;
    {
        ProgressBar bar;
        request.options.progress = [&bar](double part, const char* what) { bar.show(part, what); };
        outcome = anatomy::run_import(request);
    }
    print("{}", outcome.report);
    return 0;
}

void AnatomyCommand::add_check() {
    check_ = command_->add_subcommand("check",
                                      "Judge an anatomy by every check, with its figure\n\n"
                                      "Example:\n"
                                      "  seldinger anatomy check vessels/mine.anatomy.json");
    check_->add_option("anatomy", checked_, "NAME.anatomy.json")->required()->type_name("FILE");
    check_->footer("Exit codes: 0 usable, 2 bad input or a check that failed.");
}

int AnatomyCommand::check() const {
    const anatomy::CheckOutcome outcome = anatomy::run_check(checked_);
    print("{}", outcome.report);
    return outcome.fine ? 0 : 2;
}

void AnatomyCommand::add_export() {
    export_ =
        command_->add_subcommand("export",
                                 "Write an anatomy for another program\n\n"
                                 "Example:\n"
                                 "  seldinger anatomy export vessels/mine.anatomy.json --slicer slicer");
    export_->add_option("anatomy", exported_, "NAME.anatomy.json")->required()->type_name("FILE");
    export_
        ->add_option(
            "--slicer", slicer_,
            "Folder for what 3D Slicer opens: NAME.stl (SPACE=LPS), ends.mrk.json, targets.mrk.json and "
            "centrelines/BRANCH.mrk.json; import reads them back by --centrelines and --places")
        ->required()
        ->type_name("FOLDER");
    export_->footer("Exit codes: 0 done, 2 bad input.");
}

int AnatomyCommand::export_files() const {
    const std::filesystem::path folder(slicer_);
    const anatomy::Anatomy loaded = anatomy::load_anatomy(exported_);
    std::vector<std::filesystem::path> inputs = {exported_};
    if (const auto mesh = anatomy::mesh_named_by(exported_)) inputs.push_back(*mesh);
    io::require_distinct(
        std::array{io::Output{"--slicer", folder / (io::file_name_of(loaded.name) + ".stl")}}, inputs);
    const std::vector<std::filesystem::path> files = anatomy::write_for_slicer(loaded, folder);
    print("{}: {} files\n", folder.string(), files.size());
    for (const std::filesystem::path& file : files) print("  {}\n", file.string());
    return 0;
}

void AnatomyCommand::add_show() {
    show_ = command_->add_subcommand("show",
                                     "Draw lumen, centrelines, names, ends and targets from three sides\n\n"
                                     "Example:\n"
                                     "  seldinger anatomy show vessels/mine.anatomy.json --out mine.png");
    show_->add_option("anatomy", shown_, "NAME.anatomy.json")->required()->type_name("FILE");
    show_->add_option("--out", picture_, "The picture, a .png")
        ->required()
        ->type_name("FILE")
        ->check(picture_name());
}

int AnatomyCommand::show() const {
    io::require_writable(picture_);
    io::require_distinct(std::array{io::Output{"--out", picture_}},
                         std::array{std::filesystem::path(shown_),
                                    anatomy::mesh_named_by(shown_).value_or(std::filesystem::path())});
    anatomy::draw_anatomy(anatomy::load_anatomy(shown_), picture_);
    return 0;
}

void AnatomyCommand::add_voxelise() {
    voxelise_ = command_->add_subcommand(
        "voxelise",
        "Write the patient of a scenario as a CT, to try programs and scenarios that take one\n\n"
        "Example:\n"
        "  seldinger anatomy voxelise renal --voxel 2 --out renal.nii.gz");
    add_scenario(voxelise_, scenario_);
    voxelise_->add_option("--out", ct_, "The CT: .nii, .nii.gz or .nrrd")->required()->type_name("FILE");
    voxelise_->add_option("--voxel", voxel_, "Width of a voxel [mm]")->check(number(0.3, 10));
    voxelise_->add_option("--margin", margin_, "Above and below the vessels [mm]")->check(number(0, 1000));
    add_cache_folder(voxelise_, cache_, "cache beside --out");
}

int AnatomyCommand::voxelise() const {
    const scenario::Scenario scenario = scenario_named(scenario_);
    if (!scenario.imaging.patient || !scenario.patient_files.ct.empty())
        throw io::InputError(scenario_.named +
                             ": expected a scenario with the procedural patient, found none in it");
    patient::check_ct_name(ct_);
    require_no_input({{"--out", ct_}}, scenario, {});
    io::require_writable(ct_);
    ProgressBar bar;
    anatomy::ModelCache cache;
    cache.folder = cache_.empty() ? anatomy::cache_beside(ct_) : std::filesystem::path(cache_);
    report_on(bar, cache);
    const anatomy::Anatomy anatomy = scenario::anatomy_of(scenario, cache);
    const std::vector<render::TissueLayer> layers = exercise::tissue_layers(scenario, anatomy, cache);
    geometry::Vec3 low = layers.front().mesh.vertices.front(), high = low;  // of the skin
    for (const geometry::Vec3& v : layers.front().mesh.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    const auto [bottom, top] =
        std::minmax_element(anatomy.lumen.vertices.begin(), anatomy.lumen.vertices.end(),
                            [](const geometry::Vec3& a, const geometry::Vec3& b) { return a.z() < b.z(); });
    low.z() = std::max(low.z(), bottom->z() - margin_);
    high.z() = std::min(high.z(), top->z() + margin_);
    const render::VolumeGrid grid = patient::grid_around(low, high, voxel_);
    if (static_cast<double>(grid.count()) > patient::most_samples)
        throw io::InputError(
            "expected up to {:.0f} million voxels, found {:.0f} million of {:g} mm: a wider --voxel or a "
            "smaller "
            "--margin makes fewer",
            1e-6 * patient::most_samples, 1e-6 * static_cast<double>(grid.count()), voxel_);
    patient::write_ct(ct_, patient::voxelised(layers, grid, cache.progress));
    print("{}: {} × {} × {} voxels of {:g} mm\n", ct_, grid.size[0], grid.size[1], grid.size[2], voxel_);
    return 0;
}

}  // namespace

Command add_anatomy(CLI::App& parser) {
    const auto command = std::make_shared<AnatomyCommand>(parser);
    return {command->parser(), [command] { return command->run(); }};
}

}  // namespace app
