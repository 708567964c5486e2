BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('0001');
CREATE TABLE chore (
	name VARCHAR(20) NOT NULL, 
	done_us BIGINT NOT NULL, 
	CONSTRAINT pk_chore PRIMARY KEY (name)
);
CREATE TABLE event (
	id INTEGER NOT NULL, 
	run_id INTEGER NOT NULL, 
	t_ns BIGINT NOT NULL, 
	at_us BIGINT NOT NULL, 
	number BIGINT NOT NULL, 
	machine VARCHAR(200) NOT NULL, 
	kind VARCHAR(20) NOT NULL, 
	cause BIGINT, 
	text TEXT NOT NULL, 
	content TEXT NOT NULL, 
	CONSTRAINT pk_event PRIMARY KEY (id), 
	CONSTRAINT fk_event_run_id FOREIGN KEY(run_id) REFERENCES run (id)
);
CREATE TABLE "plan" (
	id INTEGER NOT NULL, 
	run_id INTEGER NOT NULL, 
	point_id INTEGER NOT NULL, 
	t_ns BIGINT NOT NULL, 
	at_us BIGINT NOT NULL, 
	"plan" TEXT NOT NULL, 
	origin BIGINT NOT NULL, 
	scale FLOAT NOT NULL, 
	round_p BIGINT, 
	CONSTRAINT pk_plan PRIMARY KEY (id), 
	CONSTRAINT fk_plan_run_id FOREIGN KEY(run_id) REFERENCES run (id), 
	CONSTRAINT fk_plan_point_id FOREIGN KEY(point_id) REFERENCES point (id)
);
INSERT INTO "plan" VALUES(1,1,3,0,1795457401382709,'{"start_ns":"0","base":0,"final":0.0,"segments":[]}',0,1.0,4294967296);
INSERT INTO "plan" VALUES(2,1,4,0,1795457401382709,'{"start_ns":"0","base":0,"final":0.0,"segments":[]}',0,1.0,4294967296);
INSERT INTO "plan" VALUES(3,1,5,0,1795457401382709,'{"start_ns":"0","base":0,"final":0.0,"segments":[]}',0,1.0,4294967296);
INSERT INTO "plan" VALUES(4,1,6,0,1795457401382709,'{"start_ns":"0","base":0,"final":0.0,"segments":[]}',0,1.0,4294967296);
INSERT INTO "plan" VALUES(5,1,3,2758054700,1795457404144881,'{"start_ns":"2758054700","base":0,"final":2000.0,"segments":[[1.0,0.0,0.0,0.0,500.0,0.0,1],[2.0,1.0,500.0,1000.0,0.0,0.0,1],[3.0,3.0,2000.0,0.0,-500.0,0.0,1]]}',0,1.0,4294967296);
CREATE TABLE point (
	id INTEGER NOT NULL, 
	subject VARCHAR(200) NOT NULL, 
	name VARCHAR(200) NOT NULL, 
	unit VARCHAR(40) NOT NULL, 
	type VARCHAR(20) NOT NULL, 
	CONSTRAINT pk_point PRIMARY KEY (id), 
	CONSTRAINT uq_point_subject UNIQUE (subject, name, unit, type)
);
INSERT INTO "point" VALUES(1,'cell','time.paused','','true or false');
INSERT INTO "point" VALUES(2,'cell','time.speed','','number');
INSERT INTO "point" VALUES(3,'cell','table.M1.position','imp','number');
INSERT INTO "point" VALUES(4,'cell','table.M2.position','imp','number');
INSERT INTO "point" VALUES(5,'cell','table.M3.position','imp','number');
INSERT INTO "point" VALUES(6,'cell','table.M4.position','imp','number');
INSERT INTO "point" VALUES(7,'cell','table.pins.IN1','','true or false');
INSERT INTO "point" VALUES(8,'cell','table.pins.IN2','','true or false');
INSERT INTO "point" VALUES(9,'cell','table.pins.IN3','','true or false');
INSERT INTO "point" VALUES(10,'cell','table.pins.IN4','','true or false');
INSERT INTO "point" VALUES(11,'cell','table.pins.IN5','','true or false');
INSERT INTO "point" VALUES(12,'cell','table.pins.IN6','','true or false');
INSERT INTO "point" VALUES(13,'cell','table.pins.IN7','','true or false');
INSERT INTO "point" VALUES(14,'cell','table.pins.IN8','','true or false');
INSERT INTO "point" VALUES(15,'cell','table.pins.IN9','','true or false');
INSERT INTO "point" VALUES(16,'cell','table.pins.IN10','','true or false');
INSERT INTO "point" VALUES(17,'cell','table.pins.IN11','','true or false');
INSERT INTO "point" VALUES(18,'cell','table.pins.IN12','','true or false');
INSERT INTO "point" VALUES(19,'cell','table.pins.IN13','','true or false');
INSERT INTO "point" VALUES(20,'cell','table.pins.IN14','','true or false');
INSERT INTO "point" VALUES(21,'cell','table.pins.IN15','','true or false');
INSERT INTO "point" VALUES(22,'cell','table.pins.IN16','','true or false');
INSERT INTO "point" VALUES(23,'cell','table.pins.IN17','','true or false');
INSERT INTO "point" VALUES(24,'cell','table.pins.IN18','','true or false');
INSERT INTO "point" VALUES(25,'cell','table.pins.IN19','','true or false');
INSERT INTO "point" VALUES(26,'cell','table.pins.IN20','','true or false');
INSERT INTO "point" VALUES(27,'cell','table.pins.AIN1','V','number');
INSERT INTO "point" VALUES(28,'cell','table.pins.AIN2','V','number');
INSERT INTO "point" VALUES(29,'cell','table.pins.OUT1','','true or false');
INSERT INTO "point" VALUES(30,'cell','table.pins.OUT2','','true or false');
INSERT INTO "point" VALUES(31,'cell','table.pins.OUT3','','true or false');
INSERT INTO "point" VALUES(32,'cell','table.pins.OUT4','','true or false');
INSERT INTO "point" VALUES(33,'cell','table.pins.OUT5','','true or false');
INSERT INTO "point" VALUES(34,'cell','table.pins.OUT6','','true or false');
INSERT INTO "point" VALUES(35,'cell','table.pins.OUT7','','true or false');
INSERT INTO "point" VALUES(36,'cell','table.pins.OUT8','','true or false');
INSERT INTO "point" VALUES(37,'cell','table.pins.M1_EN','','true or false');
INSERT INTO "point" VALUES(38,'cell','table.pins.M2_EN','','true or false');
INSERT INTO "point" VALUES(39,'cell','table.pins.M3_EN','','true or false');
INSERT INTO "point" VALUES(40,'cell','table.pins.M4_EN','','true or false');
INSERT INTO "point" VALUES(41,'cell','table.pins.ERR','','true or false');
INSERT INTO "point" VALUES(42,'cell','table.status','','text');
INSERT INTO "point" VALUES(43,'cell','table.status_code','','whole number');
INSERT INTO "point" VALUES(44,'cell','table.status_level','','text');
INSERT INTO "point" VALUES(45,'cell','table.program.state','','text');
INSERT INTO "point" VALUES(46,'cell','table.program.text','','text');
INSERT INTO "point" VALUES(47,'cell','table.M1.enabled','','true or false');
INSERT INTO "point" VALUES(48,'cell','table.M1.encoder','','whole number');
INSERT INTO "point" VALUES(49,'cell','table.M1.status','','text');
INSERT INTO "point" VALUES(50,'cell','table.M1.status_code','','whole number');
INSERT INTO "point" VALUES(51,'cell','table.M1.status_level','','text');
INSERT INTO "point" VALUES(52,'cell','table.M2.enabled','','true or false');
INSERT INTO "point" VALUES(53,'cell','table.M2.encoder','','whole number');
INSERT INTO "point" VALUES(54,'cell','table.M2.status','','text');
INSERT INTO "point" VALUES(55,'cell','table.M2.status_code','','whole number');
INSERT INTO "point" VALUES(56,'cell','table.M2.status_level','','text');
INSERT INTO "point" VALUES(57,'cell','table.M3.enabled','','true or false');
INSERT INTO "point" VALUES(58,'cell','table.M3.encoder','','whole number');
INSERT INTO "point" VALUES(59,'cell','table.M3.status','','text');
INSERT INTO "point" VALUES(60,'cell','table.M3.status_code','','whole number');
INSERT INTO "point" VALUES(61,'cell','table.M3.status_level','','text');
INSERT INTO "point" VALUES(62,'cell','table.M4.enabled','','true or false');
INSERT INTO "point" VALUES(63,'cell','table.M4.encoder','','whole number');
INSERT INTO "point" VALUES(64,'cell','table.M4.status','','text');
INSERT INTO "point" VALUES(65,'cell','table.M4.status_code','','whole number');
INSERT INTO "point" VALUES(66,'cell','table.M4.status_level','','text');
INSERT INTO "point" VALUES(67,'cell','table.details.data_type','','text');
INSERT INTO "point" VALUES(68,'cell','table.details.axis_control_mode','','text');
INSERT INTO "point" VALUES(69,'cell','table.details.program_bank','','whole number');
INSERT INTO "point" VALUES(70,'cell','table.details.position_bank','','whole number');
CREATE TABLE run (
	id INTEGER NOT NULL, 
	"key" VARCHAR(40) NOT NULL, 
	subject VARCHAR(200) NOT NULL, 
	"virtual" BOOLEAN NOT NULL, 
	began_ns BIGINT NOT NULL, 
	began_us BIGINT NOT NULL, 
	last_ns BIGINT NOT NULL, 
	last_us BIGINT NOT NULL, 
	ended BOOLEAN NOT NULL, 
	batches BIGINT NOT NULL, 
	CONSTRAINT pk_run PRIMARY KEY (id), 
	CONSTRAINT uq_run_key UNIQUE ("key")
);
INSERT INTO "run" VALUES(1,'685dc2c4ac4f422ab2f37fe912d38637','cell',1,0,1795457401382709,5888790489,1795457407275636,1,5);
CREATE TABLE sample (
	id INTEGER NOT NULL, 
	run_id INTEGER NOT NULL, 
	point_id INTEGER NOT NULL, 
	t_ns BIGINT NOT NULL, 
	at_us BIGINT NOT NULL, 
	value FLOAT, 
	text_id INTEGER, 
	CONSTRAINT pk_sample PRIMARY KEY (id), 
	CONSTRAINT fk_sample_run_id FOREIGN KEY(run_id) REFERENCES run (id), 
	CONSTRAINT fk_sample_point_id FOREIGN KEY(point_id) REFERENCES point (id)
);
INSERT INTO "sample" VALUES(1,1,1,0,1795457401382709,1.0,NULL);
INSERT INTO "sample" VALUES(2,1,2,0,1795457401382709,1.0,NULL);
INSERT INTO "sample" VALUES(3,1,42,0,1795457401382709,NULL,4);
INSERT INTO "sample" VALUES(4,1,43,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(5,1,44,0,1795457401382709,NULL,4);
INSERT INTO "sample" VALUES(6,1,45,0,1795457401382709,NULL,5);
INSERT INTO "sample" VALUES(7,1,46,0,1795457401382709,NULL,5);
INSERT INTO "sample" VALUES(8,1,47,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(9,1,48,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(10,1,49,0,1795457401382709,NULL,3);
INSERT INTO "sample" VALUES(11,1,50,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(12,1,51,0,1795457401382709,NULL,4);
INSERT INTO "sample" VALUES(13,1,52,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(14,1,53,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(15,1,54,0,1795457401382709,NULL,3);
INSERT INTO "sample" VALUES(16,1,55,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(17,1,56,0,1795457401382709,NULL,4);
INSERT INTO "sample" VALUES(18,1,57,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(19,1,58,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(20,1,59,0,1795457401382709,NULL,3);
INSERT INTO "sample" VALUES(21,1,60,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(22,1,61,0,1795457401382709,NULL,4);
INSERT INTO "sample" VALUES(23,1,62,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(24,1,63,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(25,1,64,0,1795457401382709,NULL,3);
INSERT INTO "sample" VALUES(26,1,65,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(27,1,66,0,1795457401382709,NULL,4);
INSERT INTO "sample" VALUES(28,1,67,0,1795457401382709,NULL,2);
INSERT INTO "sample" VALUES(29,1,68,0,1795457401382709,NULL,1);
INSERT INTO "sample" VALUES(30,1,69,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(31,1,70,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(32,1,7,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(33,1,8,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(34,1,9,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(35,1,10,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(36,1,11,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(37,1,12,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(38,1,13,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(39,1,14,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(40,1,15,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(41,1,16,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(42,1,17,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(43,1,18,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(44,1,19,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(45,1,20,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(46,1,21,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(47,1,22,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(48,1,23,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(49,1,24,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(50,1,25,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(51,1,26,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(52,1,27,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(53,1,28,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(54,1,29,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(55,1,30,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(56,1,31,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(57,1,32,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(58,1,33,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(59,1,34,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(60,1,35,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(61,1,36,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(62,1,37,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(63,1,38,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(64,1,39,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(65,1,40,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(66,1,41,0,1795457401382709,0.0,NULL);
INSERT INTO "sample" VALUES(67,1,1,1074171,1795457401387893,0.0,NULL);
INSERT INTO "sample" VALUES(68,1,37,765989999,1795457402152830,1.0,NULL);
INSERT INTO "sample" VALUES(69,1,47,823289550,1795457402210130,1.0,NULL);
INSERT INTO "sample" VALUES(70,1,49,823289550,1795457402210130,NULL,6);
INSERT INTO "sample" VALUES(71,1,50,823289550,1795457402210130,1.0,NULL);
INSERT INTO "sample" VALUES(72,1,49,2843115984,1795457404229942,NULL,7);
INSERT INTO "sample" VALUES(73,1,50,2843115984,1795457404229942,3.0,NULL);
INSERT INTO "sample" VALUES(74,1,48,5888790489,1795457407275636,250.0,NULL);
INSERT INTO "sample" VALUES(75,1,49,5888790489,1795457407275636,NULL,8);
INSERT INTO "sample" VALUES(76,1,50,5888790489,1795457407275636,4.0,NULL);
CREATE TABLE summary (
	point_id INTEGER NOT NULL, 
	at_us BIGINT NOT NULL, 
	changes INTEGER NOT NULL, 
	least FLOAT, 
	mean FLOAT, 
	most FLOAT, 
	CONSTRAINT pk_summary PRIMARY KEY (point_id, at_us), 
	CONSTRAINT fk_summary_point_id FOREIGN KEY(point_id) REFERENCES point (id)
);
CREATE TABLE text (
	id INTEGER NOT NULL, 
	text TEXT NOT NULL, 
	CONSTRAINT pk_text PRIMARY KEY (id), 
	CONSTRAINT uq_text_text UNIQUE (text)
);
INSERT INTO "text" VALUES(1,'DIRECT');
INSERT INTO "text" VALUES(2,'REAL');
INSERT INTO "text" VALUES(3,'off');
INSERT INTO "text" VALUES(4,'ok');
INSERT INTO "text" VALUES(5,'stopped');
INSERT INTO "text" VALUES(6,'on at rest');
INSERT INTO "text" VALUES(7,'moving to position');
INSERT INTO "text" VALUES(8,'position reached');
CREATE INDEX ix_sample_point_at ON sample (point_id, at_us);
CREATE INDEX ix_plan_point_at ON "plan" (point_id, at_us);
CREATE INDEX ix_event_at ON event (at_us);
COMMIT;
