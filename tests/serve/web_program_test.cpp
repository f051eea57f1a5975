// The live page of `tricoil serve` with malicious clients.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "tests/serve/serving.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Complete answer to a GET of the page with one additional header field.
std::string get_page_with(std::uint16_t port, const std::string& field) {
    const int client = connect_to(port);
    const std::string request = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" + field + "\r\n\r\n";
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string answer = read_for(client, std::chrono::seconds(20));
    close(client);
    return answer;
}

TEST(ServePage, ARangeGivesThePageAndNothingBeyondIt) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    const std::string whole = get_page_with(serving.port("web"), "Accept: text/html");
    ASSERT_THAT(whole.substr(0, 15), HasSubstr("200 OK"));
    std::string many = "Range: bytes=0-9";
    for (int n = 0; n < 900; ++n) {
        many += ",0-99999999";
    }
    for (const std::string& range :
         {std::string("Range: bytes=0-99999999"), std::string("Range: bytes=99999999-"), std::string("Range: bytes=-99999999"),
          std::string("rAnGe: bytes=9223372036854775807-"), many}) {
        EXPECT_TRUE(get_page_with(serving.port("web"), range) == whole) << range.substr(0, 40);
    }
}

TEST(ServePage, ARequestInPiecesAndFurtherOnesGetOneAnswer) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    const std::uint16_t port = serving.port("web");
    const std::string whole = get_page_with(port, "Accept: text/html");
    const std::string request = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
    const int client = connect_to(port);
    for (const char byte : request) {
        EXPECT_EQ(write(client, &byte, 1), 1);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    (void)send(client, (request + request).data(), 2 * request.size(), MSG_NOSIGNAL);
    EXPECT_TRUE(read_for(client, std::chrono::seconds(20)) == whole);
    close(client);
}

TEST(ServePage, AHeadRequestGetsTheHeadOnly) {
    const Serving serving({"--web", "0", "--scenario", "still", "--open-controls"});
    for (const char* path : {"/", "/stream", "/recordings", "/recordings/none", "/nothing"}) {
        const int client = connect_to(serving.port("web"));
        const std::string request =
            std::string("HEAD ") + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) + "\r\n\r\n";
        EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
        const std::string answer = read_for(client, std::chrono::seconds(10));
        EXPECT_THAT(answer, StartsWith("HTTP/1.1 ")) << path;
        EXPECT_EQ(answer.find("\r\n\r\n"), answer.size() - 4) << path;
        close(client);
    }
}

TEST(ServePage, TheStreamContainsTheHealthOfTheMeasurement) {
    const Serving serving({"--web", "0", "--scenario", "still", "--fault", "dropped_blocks:0.3"});
    const int client = connect_to(serving.port("web"));
    const std::string request = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) + "\r\n\r\n";
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string warning = R"("health":{"warning":"more than 1 % of the columns are missing")";
    std::string events;
    const auto end = Clock::now() + std::chrono::seconds(30);
    while (events.find(warning) == std::string::npos && Clock::now() < end) {
        events += read_for(client, std::chrono::seconds(1), 1);
    }
    close(client);
    EXPECT_THAT(events, HasSubstr(warning));
}

TEST(ServePage, TheStreamOfARecordedSimulationHasItsTruePoses) {
    const std::string folder = path_in_temp("serve_truth");
    std::filesystem::remove_all(folder);
    ASSERT_EQ(tricoil("run --json --scenario still --duration 20 --record " + folder).exit_code, 0);
    const Serving serving({folder, "--web", "0"});
    const int client = connect_to(serving.port("web"));
    const std::string request = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) + "\r\n\r\n";
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string events = read_for(client, std::chrono::seconds(10), 6000);
    close(client);
    // A pose ends with the signal-to-noise ratio, and position and quaternion of the true sensor.
    EXPECT_THAT(events, ::testing::ContainsRegex(R"(,[0-9.]+,\[(-?[0-9.e-]+,){6}-?[0-9.e-]+\]\])"));
}

TEST(ServePage, TheStreamHasTheLevelsOfTheChannels) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    const int client = connect_to(serving.port("web"));
    const std::string request = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) + "\r\n\r\n";
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string row = R"("levels":[{"coil":1,"columns":)";
    std::string events;
    const auto end = Clock::now() + std::chrono::seconds(30);
    while (events.find(row) == std::string::npos && Clock::now() < end) {
        events += read_for(client, std::chrono::seconds(1), 1);
    }
    close(client);
    EXPECT_THAT(events, HasSubstr(row));
}

/// Answer to a POST.
std::string post(std::uint16_t port, const std::string& path, const std::string& command, const std::string& token) {
    const int client = connect_to(port);
    const std::string request = "POST " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                                "\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(command.size()) +
                                "\r\n" + (token.empty() ? "" : "Authorization: Bearer " + token + "\r\n") + "\r\n" + command;
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string answer = read_for(client, std::chrono::seconds(10));
    close(client);
    return answer;
}

/// Status line of the answer to a control request.
std::string ask(std::uint16_t port, const std::string& command, const std::string& token) {
    const std::string answer = post(port, "/control", command, token);
    return answer.substr(0, answer.find('\r'));
}

std::string token_of(const std::string& link) { return link.substr(link.find("#token=") + 7); }

TEST(ServePage, ControlsNeedTheToken) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    const std::string token = token_of(serving.address("web_controls"));
    EXPECT_EQ(token.size(), 32U);
    std::string wrong = token;
    wrong.back() = wrong.back() == '0' ? '1' : '0';
    for (const std::string& bad : {std::string(), wrong, token + "0", token.substr(1), std::string(32, '0')}) {
        EXPECT_THAT(ask(serving.port("web"), R"({"run":true})", bad), HasSubstr("401")) << bad;
    }
    EXPECT_THAT(ask(serving.port("web"), R"({"run":true})", token), HasSubstr("200"));
    EXPECT_THAT(serving.err(), ::testing::Not(HasSubstr(token)));
    const Serving other({"--web", "0", "--scenario", "still"});
    EXPECT_NE(token_of(other.address("web_controls")), token);
}

/// Opens an event stream, which is a page for the server. Returns its socket.
int open_page(std::uint16_t port) {
    const int client = connect_to(port);
    const std::string request = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    EXPECT_THAT(read_for(client, std::chrono::seconds(10), 400), HasSubstr("data:"));
    return client;
}

TEST(ServePage, OnePageSetsUpADevice) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    const std::uint16_t port = serving.port("web");
    const std::string token = token_of(serving.address("web_controls"));
    const auto set_up = [&](const std::string& request) { return post(port, "/setup", request, token); };
    EXPECT_THAT(post(port, "/setup", R"({"page":1})", ""), HasSubstr("401"));
    EXPECT_THAT(set_up(R"({"page":1})"), HasSubstr("this page is not connected"));
    const int first = open_page(port);
    const int second = open_page(port);
    EXPECT_THAT(set_up(R"({"page":1})"), HasSubstr("the set-up has begun"));
    EXPECT_THAT(set_up(R"({"page":2})"), HasSubstr("409 Conflict"));
    EXPECT_THAT(set_up(R"({"page":2,"run":"devices"})"),
                HasSubstr("another page sets up this device; close the set-up there first"));
    const std::string devices = set_up(R"({"page":1,"run":"devices"})");
    EXPECT_THAT(devices, HasSubstr(R"("code":0,"result":[)"));
    EXPECT_THAT(set_up(R"({"page":1,"end":true})"), HasSubstr("the set-up has ended"));
    EXPECT_THAT(set_up(R"({"page":2})"), HasSubstr("the set-up has begun"));
    close(second);
    const auto end = Clock::now() + std::chrono::seconds(20);
    std::string answer;
    while (answer.find("has begun") == std::string::npos && Clock::now() < end) {
        answer = set_up(R"({"page":1})");
    }
    EXPECT_THAT(answer, HasSubstr("the set-up has begun")) << "a page that was closed still has the set-up";
    close(first);
}

TEST(ServePage, TheSetUpRunsListedCommandsOnRecordingsOnly) {
    const std::string folder = path_in_temp("set_up");
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const Serving serving({"--web", "0", "--scenario", "still", "--open-controls", "--record-folder", folder});
    const std::uint16_t port = serving.port("web");
    const int page = open_page(port);
    const auto run = [&](const std::string& request) { return post(port, "/setup", R"({"page":1,"run":)" + request + "}", ""); };
    for (const char* bad : {R"("serve")", R"("")", "3", R"("stage","recording":"a")", R"("--help")"}) {
        EXPECT_THAT(run(bad), HasSubstr("set-up: unknown command")) << bad;
    }
    for (const char* bad : {R"("..")", R"("/etc")", R"("none")", R"("-a")", "3", R"("")"}) {
        EXPECT_THAT(run(R"("pivot","recording":)" + std::string(bad)), HasSubstr("there is no such recording")) << bad;
    }
    EXPECT_THAT(ask(port, R"({"record":true,"name":"take"})", ""), HasSubstr("200"));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    EXPECT_THAT(ask(port, R"({"record":false})", ""), HasSubstr("200"));
    for (const char* bad : {R"(["--out=/tmp/x"])", R"(["--blob=x"])", R"(["--at=1;2"])", R"(["/etc/passwd"])", "[3]"}) {
        EXPECT_THAT(run(R"("wiring","recording":"take","options":)" + std::string(bad)), HasSubstr("set-up: unknown option"))
            << bad;
    }
    EXPECT_THAT(run(R"("wiring","recording":"take","options":["--at=1,2"])"), HasSubstr("--at"));
    EXPECT_THAT(run(R"("wiring","recording":"take","options":["--at=0.5,0,0"])"),
                HasSubstr("several wirings give the same couplings"));
    EXPECT_THAT(run(R"("free-motion","recording":"take","options":["--hemisphere=1,0,0","--coupling-constant=-1"])"),
                HasSubstr("--coupling-constant must lie between"));
    const std::string tip = run(R"("pivot","recording":"take")");
    EXPECT_THAT(tip, HasSubstr(R"("code":2)"));
    EXPECT_THAT(tip, ::testing::Not(HasSubstr(folder))) << "clients do not see the folder";
    close(page);
}

TEST(ServePage, ARefusedRecordingIsNoSuccess) {
    const Serving serving({"--web", "0", "--scenario", "still", "--open-controls"});
    EXPECT_THAT(ask(serving.port("web"), R"({"record":true})", ""), HasSubstr("422"));  // without --record-folder
    EXPECT_THAT(ask(serving.port("web"), R"({"record":false})", ""), HasSubstr("200"));
}

TEST(ServePage, ControlsAreOpenOrClosedByOption) {
    const Serving open({"--web", "0", "--scenario", "still", "--open-controls"});
    EXPECT_THAT(ask(open.port("web"), R"({"run":true})", ""), HasSubstr("200"));
    const Serving closed({"--web", "0", "--scenario", "still", "--read-only"});
    EXPECT_THAT(ask(closed.port("web"), R"({"run":true})", ""), HasSubstr("403"));
    EXPECT_EQ(tricoil("serve --web 0 --read-only --open-controls").exit_code, 2);
}

unsigned mode_of(const std::string& path) {
    struct stat about {};
    EXPECT_EQ(stat(path.c_str(), &about), 0);
    return about.st_mode & 0777U;
}

TEST(ServePage, TheLinkGoesToAFileThatOnlyTheUserReads) {
    const std::string path = write_file("controls", "older\n");
    const Serving serving({"--web", "0", "--scenario", "still", "--token-file", path});
    const std::string link = read_file(path);
    EXPECT_THAT(link, HasSubstr(serving.address("web") + "#token="));
    EXPECT_THAT(ask(serving.port("web"), R"({"run":true})", token_of(link.substr(0, link.size() - 1))), HasSubstr("200"));
    EXPECT_EQ(mode_of(path), 0600U);
}

TEST(ServePage, TheLinkGoesToTheTargetOfASymbolicLink) {
    const std::string target = write_file("controls_target", "older\n");
    std::filesystem::permissions(target, std::filesystem::perms(0644));
    const std::string path = path_in_temp("controls_link");
    std::filesystem::remove(path);
    std::filesystem::create_symlink("controls_target", path);
    const Serving serving({"--web", "0", "--scenario", "still", "--token-file", path});
    EXPECT_TRUE(std::filesystem::is_symlink(path));
    EXPECT_THAT(read_file(target), HasSubstr("#token="));
    EXPECT_EQ(mode_of(target), 0600U);
}

/// An inherited JOURNAL_STREAM is not the journal; one with the device and inode of the output is.
TEST(ServePage, TheLinkIsNotWrittenToTheJournal) {
    const std::string command = TRICOIL_PROGRAM " serve --web 0 --scenario still --duration 0.1 --json";
    const auto inherited = run_program("JOURNAL_STREAM=9:8 " + command, "");
    EXPECT_THAT(inherited.out, HasSubstr("#token="));
    EXPECT_THAT(inherited.err, ::testing::Not(HasSubstr("journal")));
    for (const char* descriptor : {"1", "2"}) {
        const std::string stream = std::string("export JOURNAL_STREAM=$(stat -L -c %d:%i /proc/$$/fd/") + descriptor + ")";
        const auto journal = run_program("sh -c '" + stream + "; exec " + command + "'", "");
        EXPECT_THAT(journal.out, ::testing::Not(HasSubstr("#token="))) << descriptor;
        EXPECT_THAT(journal.err, HasSubstr("the link for controls is not written to the journal")) << descriptor;
    }
}

TEST(ServePage, AddressesOtherThanLoopbackCauseAWarning) {
    const Serving wide({"--web", "0.0.0.0:0", "--fastrak", "tcp:0.0.0.0:0", "--open-controls", "--scenario", "still"});
    EXPECT_THAT(wide.err(), HasSubstr("--web 0.0.0.0:0: everyone who reaches this address can read poses, switch the coils"));
    EXPECT_THAT(wide.err(), HasSubstr("--fastrak 0.0.0.0:0: everyone who reaches this address"));
    const Serving narrow({"--web", "0", "--openigtlink", "0", "--scenario", "still"});
    EXPECT_THAT(narrow.err(), ::testing::Not(HasSubstr("everyone who reaches")));
}

TEST(ServePage, ANameNeedsToBeAllowed) {
    for (const bool allowed : {false, true}) {
        std::vector<std::string> options{"--web", "0.0.0.0:0", "--scenario", "still"};
        if (allowed) {
            options.insert(options.end(), {"--allow-host", "tracker.example"});
        }
        const Serving serving(options);
        const int client = connect_to(serving.port("web"));
        const std::string request =
            "HEAD / HTTP/1.1\r\nHost: tracker.example:" + std::to_string(serving.port("web")) + "\r\n\r\n";
        EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
        EXPECT_THAT(read_for(client, std::chrono::seconds(10), 15), HasSubstr(allowed ? "200" : "403"));
        close(client);
    }
}

TEST(ServeFastrak, ATcpClientSetsNoHemisphereUnlessControlsAreOpen) {  // the protocol has no field for a token
    const Serving serving({"--fastrak", "tcp:0", "--scenario", "still"});
    const int client = connect_to(serving.port("fastrak"));
    EXPECT_EQ(write(client, "H1,-1,0,0\r", 10), 10);
    EXPECT_THAT(read_for(client, std::chrono::seconds(10), 40), HasSubstr("EC-4"));
    std::string record;
    for (int n = 0; n < 1000 && record.substr(0, 3) != "01 "; ++n) {
        EXPECT_EQ(write(client, "P", 1), 1);
        record = read_for(client, std::chrono::milliseconds(20));
        record = record.substr(record.size() - std::min<std::size_t>(record.size(), 47));
    }
    EXPECT_GT(std::stod(record.substr(3, 7)), 0) << record;
    close(client);
}

}  // namespace
}  // namespace tricoil::test
