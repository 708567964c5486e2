/* A fast closed-loop client: every connection sends its request, waits for the whole answer, sends again.
 *
 * It never sleeps while it measures: waking a client is work of the server, and how often a client sleeps depends on the
 * server's speed, so that a sleeping client would make the slower server slower still.
 *
 * client tcp PORT CONNECTIONS SECONDS REQUEST_HEX            as fast as answers come
 * client rate PORT CONNECTIONS SECONDS REQUEST_HEX HERTZ     each connection HERTZ times a second
 * client tcp PORT CONNECTIONS SECONDS REQUEST_HEX 0 BLOCKS   connections read so many different blocks
 * client tty PATH ANSWER_BYTES SECONDS REQUEST_HEX           over a terminal; PATH may be fd:NUMBER, an open one
 *
 * Prints: requests, seconds, p50 us, p99 us.
 */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define MOST_SAMPLES 8000000

struct connection { int fd; uint64_t sent, due; int got, want; unsigned char head[6]; };

static float *samples;
static size_t taken;

static uint64_t now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static void die(const char *what) { perror(what); exit(1); }

static int by_size(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void sample(uint64_t since) {
    if (taken < MOST_SAMPLES) samples[taken++] = (float)(now_ns() - since) / 1000.0f;
}

static void report(double seconds) {
    if (!taken) { fprintf(stderr, "no answer at all\n"); exit(1); }
    qsort(samples, taken, sizeof *samples, by_size);
    printf("%zu %.6f %.1f %.1f\n", taken, seconds, samples[taken / 2], samples[(size_t)((double)taken * 0.99)]);
}

static int unhex(const char *text, unsigned char *out) {
    int n = 0;
    for (; text[0] && text[1]; text += 2, n++) { unsigned v; sscanf(text, "%2x", &v); out[n] = (unsigned char)v; }
    return n;
}

static int dial(int port) {
    int fd = socket(AF_INET, SOCK_STREAM, 0), one = 1;
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd < 0 || connect(fd, (struct sockaddr *)&to, sizeof to) < 0) die("connect");
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    return fd;
}

static void ask(struct connection *c, const unsigned char *request, int size) {
    c->sent = now_ns();
    c->got = 0;
    c->want = 6;
    if (write(c->fd, request, (size_t)size) != size) die("write");
}

/* 1 when the answer is complete. */
static int listen_to(struct connection *c) {
    unsigned char data[512];
    ssize_t n = read(c->fd, data, sizeof data);
    if (n <= 0) die("read: the server closed");
    for (ssize_t i = 0; i < n && c->got + i < 6; i++) c->head[c->got + i] = data[i];
    c->got += (int)n;
    if (c->got >= 6) c->want = 6 + (c->head[4] << 8 | c->head[5]);
    return c->got >= c->want;
}

/* ``blocks`` > 1: connection i reads i % blocks * 2 registers further on, so that not all of them ask for the same. */
static void tcp(int port, int count, double seconds, const unsigned char *asked, int size, double hertz, int blocks) {
    unsigned char request[300];
    struct connection *all = calloc((size_t)count, sizeof *all);
    struct epoll_event events[512];
    int ep = epoll_create1(0);
    for (int i = 0; i < count; i++) {
        all[i].fd = dial(port);
        struct epoll_event e = {.events = EPOLLIN, .data.u32 = (uint32_t)i};
        epoll_ctl(ep, EPOLL_CTL_ADD, all[i].fd, &e);
    }
    memcpy(request, asked, (size_t)size);
#define ASK(i) (request[9] = (unsigned char)(asked[9] + (blocks > 1 ? 2 * ((i) % blocks) : 0)), ask(&all[i], request, size))
    /* Connections that are still being accepted are not what is measured. */
    for (int i = 0; i < count; i++) {
        ASK(i);
        while (!listen_to(&all[i])) continue;
        all[i].sent = 0;
    }
    uint64_t begin = now_ns(), end = begin + (uint64_t)(seconds * 1e9);
    uint64_t period = hertz > 0 ? (uint64_t)(1e9 / hertz) : 0;
    int next = 0;
    for (int i = 0; i < count; i++) {
        if (period) all[i].due = begin + period * (uint64_t)i / (uint64_t)count;
        else ASK(i);
    }
    while (now_ns() < end) {
        int wait = 0;
        /* Due times are evenly spread, so one pointer going round finds the next of them. */
        while (period) {
            uint64_t t = now_ns();
            if (all[next].due > t) { wait = (all[next].due - t) > 2000000 ? 1 : 0; break; }
            struct connection *c = &all[next];
            if (c->sent == 0) { ASK(next); c->sent = c->due; }
            c->due += period;
            next = (next + 1) % count;
        }
        int n = epoll_wait(ep, events, 512, wait);
        for (int i = 0; i < n; i++) {
            struct connection *c = &all[events[i].data.u32];
            if (!listen_to(c)) continue;
            sample(c->sent);
            if (period) c->sent = 0;
            else ASK((int)events[i].data.u32);
        }
    }
    report((double)(now_ns() - begin) / 1e9);
}

static void tty(const char *path, int answer, double seconds, const unsigned char *request, int size) {
    unsigned char data[512];
    struct termios raw;
    int fd;
    if (sscanf(path, "fd:%d", &fd) != 1) {
        fd = open(path, O_RDWR | O_NOCTTY);
        if (fd < 0) die(path);
        tcgetattr(fd, &raw);
        cfmakeraw(&raw);
        raw.c_cc[VMIN] = 1;
        raw.c_cc[VTIME] = 0;
        tcsetattr(fd, TCSANOW, &raw);
    }
    uint64_t begin = now_ns(), end = begin + (uint64_t)(seconds * 1e9);
    while (now_ns() < end) {
        uint64_t sent = now_ns();
        if (write(fd, request, (size_t)size) != size) die("write");
        for (int got = 0; got < answer;) {
            struct pollfd p = {fd, POLLIN, 0};
            int ready = poll(&p, 1, 0);
            if (ready < 0) die("poll");
            if (!ready && now_ns() - sent > 2000000000u) { fprintf(stderr, "no answer on %s\n", path); exit(1); }
            if (!ready) continue;
            ssize_t n = read(fd, data, sizeof data);
            if (n <= 0) die("read");
            got += (int)n;
        }
        sample(sent);
    }
    report((double)(now_ns() - begin) / 1e9);
}

int main(int argc, char **argv) {
    unsigned char request[300];
    struct rlimit files;
    getrlimit(RLIMIT_NOFILE, &files);
    files.rlim_cur = files.rlim_max;
    setrlimit(RLIMIT_NOFILE, &files);
    if (argc < 6) { fprintf(stderr, "usage: see the head of the source\n"); return 2; }
    samples = malloc(MOST_SAMPLES * sizeof *samples);
    int size = unhex(argv[5], request);
    if (!strcmp(argv[1], "tty")) tty(argv[2], atoi(argv[3]), atof(argv[4]), request, size);
    else tcp(atoi(argv[2]), atoi(argv[3]), atof(argv[4]), request, size, argc > 6 ? atof(argv[6]) : 0,
        argc > 7 ? atoi(argv[7]) : 1);
    return 0;
}
