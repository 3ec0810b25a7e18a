#include "engine/anatomy/model_cache.h"

#include <atomic>
#include <sys/stat.h>
#include <thread>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

namespace fs = std::filesystem;

std::string bytes(std::size_t count) {
    return std::string(count, 'x');
}

fs::perms rights(const fs::path& path) {
    return fs::status(path).permissions();
}

/// For as long as it exists.
class Umask {
public:
    explicit Umask(mode_t mask) : before_(::umask(mask)) {}
    ~Umask() { ::umask(before_); }

private:
    mode_t before_;
};

}  // namespace

TEST(ModelCache, OneLooksAfterAPlaceWhileTheOtherWaits) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder / "cache", {}};
    std::atomic<int> made = 0;
    const auto work = [&] {
        const CachePlace place(cache, "field-1.bin");
        if (fs::exists(place.path())) return;
        ++made;
        std::this_thread::sleep_for(std::chrono::milliseconds(30));
        place.keep_file("content");
    };
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(made, 1);
    EXPECT_EQ(test::read(folder / "cache/field-1.bin"), "content");
    // Neither locks nor parts are left.
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "cache"), {}), 1);
}

TEST(ModelCache, WhatWasNotUsedForLongestGoesFirst) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder.path(), {}};
    for (const char* name : {"field-a.bin", "field-b.bin", "ct-c.bin"}) {
        CachePlace(cache, name).keep_file(bytes(1000));
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    test::write(folder / "mine.txt", "not of the cache");
    CachePlace(cache, "field-a.bin").used();
    std::vector<CacheItem> items = cache_items(folder.path());
    ASSERT_EQ(items.size(), 3u);
    EXPECT_EQ(items[0].path.filename(), "field-a.bin");
    EXPECT_EQ(items[2].path.filename(), "field-b.bin");
    EXPECT_EQ(items[1].bytes, 1000u);
    const std::vector<CacheItem> removed = shrink_cache(folder.path(), 2500).removed;
    ASSERT_EQ(removed.size(), 1u);
    EXPECT_EQ(removed[0].path.filename(), "field-b.bin");
    shrink_cache(folder.path(), 0);
    EXPECT_TRUE(cache_items(folder.path()).empty());
    EXPECT_TRUE(fs::exists(folder / "mine.txt"));
}

TEST(ModelCache, IsItsOwnersAloneAndSoIsWhatIsOfACtInAFolderThatIsOpen) {
    const test::TemporaryFolder folder;
    const Umask nobody_is_kept_out(0);
    const auto owner_reads = fs::perms::owner_read | fs::perms::owner_write;
    const ModelCache made{folder / "below/cache", {}};
    CachePlace(made, "ct-1.bin").keep_file("voxels");
    EXPECT_EQ(rights(folder / "below"), fs::perms::all);
    EXPECT_EQ(rights(made.folder), fs::perms::owner_all);
    EXPECT_EQ(rights(made.folder / "ct-1.bin"), owner_reads);

    fs::create_directory(folder / "shared");
    const ModelCache shared{folder / "shared", {}};
    test::write(folder / "shared/ct-2.bin", "of an earlier version");
    ASSERT_NE(rights(folder / "shared/ct-2.bin"), owner_reads);
    CachePlace(shared, "ct-1.bin").keep_file("voxels");
    CachePlace(shared, "ct-2.bin").used();
    CachePlace(shared, "field-1.bin").keep_file("a wall");
    EXPECT_EQ(rights(shared.folder), fs::perms::all) << "a folder that is there is the user's own";
    EXPECT_EQ(rights(shared.folder / "ct-1.bin"), owner_reads);
    EXPECT_EQ(rights(shared.folder / "ct-2.bin"), owner_reads);
    EXPECT_NE(rights(shared.folder / "field-1.bin"), owner_reads);
}

TEST(ModelCache, WhatIsOfACtIsRemovedAlone) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder.path(), {}};
    for (const char* name : {"field-a.bin", "ct-b.bin", "body-c.bin", "ct-d.bin"})
        CachePlace(cache, name).keep_file(bytes(10));
    test::write(folder / "ct-e.bin.999999999.1.part", "half");
    for (const CacheItem& item : cache_items(folder.path()))
        EXPECT_EQ(item.of_ct, item.path.filename().string().starts_with("ct-")) << item.path;
    EXPECT_EQ(remove_of_ct(folder.path()).removed.size(), 2u);
    EXPECT_EQ(test::names_in(folder.path()), (std::vector<std::string>{"body-c.bin", "field-a.bin"}));
}

TEST(ModelCache, ADamagedAnatomyIsMadeAgain) {
    const test::TemporaryFolder folder;
    const ModelCache cache{folder.path(), {}};
    const VesselTreeSpec spec = vessel_preset("rca");
    const std::uint64_t hash = hash_of(generated_anatomy(spec, cache));
    const fs::path file = cache_items(folder.path()).at(0).path;
    const std::string whole = test::read(file);
    std::string changed = whole, of_another = whole;
    changed[whole.size() / 2] ^= 1;
    of_another[8] ^= 1;  // the key
    for (const std::string& damaged :
         {changed, of_another, whole + "x", whole.substr(0, whole.size() / 2), whole.substr(0, 20)}) {
        test::write(file, damaged);
        const int before = made(Made::Vessels);
        EXPECT_FALSE(is_kept(spec, cache));
        EXPECT_EQ(hash_of(generated_anatomy(spec, cache)), hash);
        EXPECT_EQ(made(Made::Vessels), before + 1);
        EXPECT_EQ(test::read(file), whole);
    }
}

TEST(ModelCache, AFolderThatCannotBeWrittenIsNotedOnce) {
    const test::TemporaryFolder folder;
    test::write(folder / "file", "");
    int notes = 0;
    const ModelCache cache{folder / "file/cache", {}, [&](const std::string& text) {
                               ++notes;
                               test::expect_said(text, "cannot be kept");
                           }};
    for (int i = 0; i < 2; ++i) {
        const CachePlace place(cache, "field-1.bin");
        EXPECT_FALSE(place.keep_file("content"));
    }
    EXPECT_EQ(notes, 1);
}

TEST(ModelCache, LeftoversOfProcessesThatEndedAreRemoved) {
    const test::TemporaryFolder folder;
    test::write(folder / "field-1.bin.999999999.1.part", "half");
    fs::create_directory(folder / "anatomy-1.999999999.2.part");
    test::write(folder / "anatomy-1.999999999.2.part/a", "half");
    const std::string own = "field-2.bin." + std::to_string(::getpid()) + ".3.part";
    test::write(folder / own, "being written");
    const ModelCache cache{folder.path(), {}};
    { const CachePlace place(cache, "field-3.bin"); }
    EXPECT_FALSE(fs::exists(folder / "field-1.bin.999999999.1.part"));
    EXPECT_FALSE(fs::exists(folder / "anatomy-1.999999999.2.part"));
    EXPECT_TRUE(fs::exists(folder / own));
}

TEST(ModelCache, VesselsHaveTheSameBitsWhetherTheyCanBeKeptOrNot) {
    const test::TemporaryFolder folder;
    const VesselTreeSpec spec = vessel_preset("rca", 2);
    const ModelCache none, cache{folder.path(), {}};
    const std::uint64_t hash = hash_of(generated_anatomy(spec, none));
    EXPECT_EQ(hash_of(generated_anatomy(spec, cache)), hash);  // just grown
    EXPECT_EQ(hash_of(generated_anatomy(spec, cache)), hash);  // read
}

TEST(ModelCache, WhatIsNoFileInThePlaceOfOneIsReplaced) {
    const test::TemporaryFolder folder;
    test::write(folder / "mine", "mine");
    const ModelCache cache{folder.path(), {}};
    const CachePlace place(cache, "field-1.bin");
    const auto keeps = [&] {
        EXPECT_TRUE(place.keep_file("content"));
        EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder / "field-1.bin")));
        EXPECT_EQ(test::read(folder / "field-1.bin"), "content");
        fs::remove(folder / "field-1.bin");
    };
    ASSERT_EQ(::mkfifo((folder / "field-1.bin").c_str(), 0600), 0);
    ASSERT_EQ(cache_items(folder.path()).size(), 1u);
    EXPECT_EQ(cache_items(folder.path())[0].bytes, 0u);
    keeps();
    for (const char* target : {"/dev/null", "/dev/full", "mine", "nowhere/x"}) {
        fs::create_symlink(target, folder / "field-1.bin");
        keeps();
    }
    fs::create_directory(folder / "field-1.bin");
    keeps();
    EXPECT_EQ(test::read(folder / "mine"), "mine");
    ASSERT_EQ(::mkfifo((folder / "field-2.bin").c_str(), 0600), 0);
    EXPECT_EQ(shrink_cache(folder.path(), 0).removed.size(), 1u);
}

}  // namespace anatomy
