/* A libmodbus server around select(), with plain static registers: what C gives.
 *
 * libmodbus_server tcp PORT | libmodbus_server rtu DEVICE
 */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

static void serve_tcp(modbus_t *ctx, modbus_mapping_t *map) {
    unsigned char query[MODBUS_TCP_MAX_ADU_LENGTH];
    fd_set all, ready;
    int listener = modbus_tcp_listen(ctx, 128), highest = listener;
    if (listener < 0) { fprintf(stderr, "listen: %s\n", modbus_strerror(errno)); exit(1); }
    FD_ZERO(&all);
    FD_SET(listener, &all);
    puts("ready");
    fflush(stdout);
    for (;;) {
        ready = all;
        if (select(highest + 1, &ready, NULL, NULL, NULL) < 0) exit(1);
        for (int fd = 0; fd <= highest; fd++) {
            if (!FD_ISSET(fd, &ready)) continue;
            if (fd == listener) {
                int client = accept(listener, NULL, NULL);
                FD_SET(client, &all);
                if (client > highest) highest = client;
                continue;
            }
            modbus_set_socket(ctx, fd);
            int n = modbus_receive(ctx, query);
            if (n > 0) modbus_reply(ctx, query, n, map);
            else if (n < 0) { close(fd); FD_CLR(fd, &all); }
        }
    }
}

static void serve_rtu(modbus_t *ctx, modbus_mapping_t *map) {
    unsigned char query[MODBUS_RTU_MAX_ADU_LENGTH];
    modbus_set_slave(ctx, 1);
    if (modbus_connect(ctx) < 0) { fprintf(stderr, "open: %s\n", modbus_strerror(errno)); exit(1); }
    puts("ready");
    fflush(stdout);
    for (;;) {
        int n = modbus_receive(ctx, query);
        if (n > 0) modbus_reply(ctx, query, n, map);
    }
}

int main(int argc, char **argv) {
    if (argc < 3) return 2;
    modbus_mapping_t *map = modbus_mapping_new(7000, 0, 12000, 0);
    if (!strcmp(argv[1], "tcp")) serve_tcp(modbus_new_tcp("127.0.0.1", atoi(argv[2])), map);
    else serve_rtu(modbus_new_rtu(argv[2], 38400, 'N', 8, 1), map);
    return 0;
}
