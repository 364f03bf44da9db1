// All chords of parallel lines by Embree 3: sphere points, packets of 16 rays, and a filter that
// collects every hit and lets the ray go on. Prints seconds, chords and kept gaps.
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>
#include <vector>

struct Query : RTCIntersectContext {
    std::vector<std::pair<float, float>> chords[16];  // entry and exit of each ray of the packet
};

static const float *spheres;
static const float far_away = 1e4f;

static void collect(const RTCFilterFunctionNArguments *given)
{
    Query *query = static_cast<Query *>(given->context);
    for (unsigned i = 0; i < given->N; i++) {
        if (given->valid[i] != -1) continue;
        given->valid[i] = 0;  // go on behind this hit
        if (RTCHitN_Ng_z(given->hit, given->N, i) > 0) continue;  // the way out: known already
        const float *sphere = spheres + 4 * RTCHitN_primID(given->hit, given->N, i);
        float entry = RTCRayN_tfar(given->ray, given->N, i) - far_away;
        query->chords[RTCRayN_id(given->ray, given->N, i)].emplace_back(entry, 2 * sphere[2] - entry);
    }
}

int main(int, char **words)
{
    const double first = atof(words[2]), spacing = atof(words[3]);
    const long lines = atol(words[4]);
    const double window = atof(words[5]), cutoff = atof(words[6]);
    std::vector<float> data;
    FILE *file = fopen(words[1], "rb");
    for (float x; fread(&x, sizeof x, 1, file) == 1;) data.push_back(x);
    fclose(file);

    RTCDevice device = rtcNewDevice("threads=1");
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    float *vertices = static_cast<float *>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, data.size() / 4));
    std::copy(data.begin(), data.end(), vertices);
    spheres = vertices;
    rtcSetGeometryIntersectFilterFunction(geometry, collect);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcAttachGeometry(scene, geometry);
    rtcCommitScene(scene);

    Query query;
    long hits = 0, kept = 0;
    std::clock_t start = std::clock();  // of this thread's work, whatever else the machine does
    for (long row = 0; row < lines; row += 4) {  // a packet is a square of 4 by 4 lines
        for (long column = 0; column < lines; column += 4) {
            rtcInitIntersectContext(&query);
            query.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
            alignas(64) int valid[16];
            alignas(64) RTCRayHit16 packet;
            for (int i = 0; i < 16; i++) {
                double x = first + (column + i % 4) * spacing, y = first + (row + i / 4) * spacing;
                bool inside = x * x + y * y < window * window;
                valid[i] = inside && column + i % 4 < lines && row + i / 4 < lines ? -1 : 0;
                packet.ray.org_x[i] = x, packet.ray.org_y[i] = y, packet.ray.org_z[i] = -far_away;
                packet.ray.dir_x[i] = 0, packet.ray.dir_y[i] = 0, packet.ray.dir_z[i] = 1;
                packet.ray.tnear[i] = 0, packet.ray.tfar[i] = 2 * far_away, packet.ray.time[i] = 0;
                packet.ray.mask[i] = -1, packet.ray.id[i] = i, packet.ray.flags[i] = 0;
                packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
                query.chords[i].clear();
            }
            rtcIntersect16(valid, scene, &query, &packet);
            for (int i = 0; i < 16; i++) {
                if (!valid[i]) continue;
                auto &chords = query.chords[i];
                std::sort(chords.begin(), chords.end());
                hits += chords.size();
                double x = packet.ray.org_x[i], y = packet.ray.org_y[i];
                double half = std::sqrt(std::max(window * window - x * x - y * y, 0.0)), solid = -half;
                for (auto &chord : chords) {
                    kept += std::min<double>(chord.first, half) - solid >= cutoff;
                    solid = std::max<double>(solid, chord.second);
                }
                kept += half - solid >= cutoff;
            }
        }
    }
    double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
    printf("%.9f %ld %ld\n", seconds, hits, kept);
}
