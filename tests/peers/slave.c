/* A slave on libmodbus with the addresses of a MIC488, firmware 1.70: what is written is there, and axes are at their target at once.
 *
 * slave tcp - | slave rtu DEVICE. Prints the port it listens on, or 0.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { CONTROL = 10000, STATUS = CONTROL + 10, M_ENABLE = CONTROL + 14, POS_ACT = CONTROL + 20, POS_ABS = CONTROL + 84 };

static void act(modbus_mapping_t *map, const unsigned char *pdu) {
    int address = pdu[1] << 8 | pdu[2];
    if (pdu[0] == 6 && address == M_ENABLE)
        for (int axis = 0; axis < 4; axis++)
            if (pdu[4] >> axis & 1) map->tab_registers[STATUS + axis] = 1;
    if (pdu[0] == 16 && address >= POS_ABS && address < POS_ABS + 8) {
        memcpy(map->tab_registers + POS_ACT + address - POS_ABS, map->tab_registers + address, 4);
        map->tab_registers[STATUS + (address - POS_ABS) / 2] = 4;
    }
}

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    int tcp = !strcmp(argv[1], "tcp"), listener = -1;
    modbus_t *ctx = tcp ? modbus_new_tcp("127.0.0.1", 0) : modbus_new_rtu(argv[2], 38400, 'N', 8, 1);
    modbus_mapping_t *map = modbus_mapping_new(7000, 6000, 12000, 0);
    unsigned char query[MODBUS_TCP_MAX_ADU_LENGTH];
    modbus_set_slave(ctx, 1);
    modbus_set_byte_timeout(ctx, 60, 0);
    if (tcp) {
        struct sockaddr_in where;
        socklen_t size = sizeof where;
        listener = modbus_tcp_listen(ctx, 8);
        getsockname(listener, (struct sockaddr *)&where, &size);
        printf("%d\n", ntohs(where.sin_port));
        fflush(stdout);
        modbus_tcp_accept(ctx, &listener);
    } else {
        if (modbus_connect(ctx) < 0) { fprintf(stderr, "%s\n", modbus_strerror(errno)); return 1; }
        puts("0");
        fflush(stdout);
    }
    for (;;) {
        int size = modbus_receive(ctx, query);
        if (size < 0 && tcp) {
            modbus_close(ctx);
            modbus_tcp_accept(ctx, &listener);
        } else if (size > 0) {
            modbus_reply(ctx, query, size, map);
            act(map, query + modbus_get_header_length(ctx));
        }
    }
}
